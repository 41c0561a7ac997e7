"""A surface with a given number of nodes, and small edits of a closed triangulation: nodes come and go, edges flip."""

from collections.abc import Callable

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import Surface, signed_volume, triangle_normals, unique_edges
from studies.geometry.mesh.quality import triangle_radius_ratio
from studies.geometry.shape.levelset import Shape, project

TOLERANCE = 0.02
"""Largest relative deviation from the node count that edits of single nodes correct (or 5 nodes)."""
CLOSE = 0.005
"""Relative deviation at which the search stops: so few edits do not reduce the quality."""
FEWEST, MOST = 60, 20_000
TRIES = 12
QUALITY = 0.2
"""Smallest radius ratio of a triangle; below it the fill has slivers with any optimiser."""


def surface_with(
    nodes: int, area: float, mesh_at: Callable[[float], Surface], shape: Shape, handles: int = 0
) -> Surface:
    """A good closed surface on f = 0 with exactly `nodes` nodes, or within TOLERANCE or 5 if single edits fail.

    area: of the true surface [m^2]; mesh_at: edge length [m] -> surface; handles: number that it has to have. Raises
    StudyError for `nodes` outside FEWEST to MOST, and if no try is one outward sheet without slivers.
    """
    if not FEWEST <= nodes <= MOST:
        raise StudyError(f"{shape.name}: {nodes} surface nodes asked for, but the mesher offers {FEWEST} to {MOST}")
    size = 1.06 * np.sqrt(2.0 * area / (np.sqrt(3.0) * nodes))
    candidates: list[tuple[float, Surface]] = []
    for attempt in range(TRIES):
        points, triangles = mesh_at(size)
        miss = abs(len(points) / nodes - 1.0)
        if miss <= max(TOLERANCE, 5.0 / nodes):
            edited, triangles = with_node_count(points, triangles, nodes)
            surface = project(shape, edited), triangles
            if is_good(*surface, handles):
                candidates.append((miss, surface))
                if miss <= CLOSE and len(edited) == nodes:
                    break
        # N ~ size^-2; a small alternating overshoot keeps the search from repeating one bad mesh.
        size *= (len(points) / nodes) ** 0.5 * (1.0 + 0.005 * (-1) ** attempt * (attempt // 2))
    if not candidates:
        raise StudyError(
            f"{shape.name}: no well-shaped surface with {nodes} nodes in {TRIES} tries; "
            "ask for more nodes, or for a smoother shape"
        )
    return min(candidates, key=lambda item: (len(item[1][0]) != nodes, item[0]))[1]


def is_good(points: np.ndarray, triangles: np.ndarray, handles: int = 0) -> bool:
    if handles_of(points, triangles) != handles or signed_volume(points, triangles) <= 0:
        return False
    return bool(triangle_radius_ratio(points, triangles).min() > QUALITY)


def handles_of(points: np.ndarray, triangles: np.ndarray) -> int:
    """Number of handles of a connected closed surface of points (n, 3), all used: 1 - (V - E + F) / 2."""
    return 1 - (len(points) - len(unique_edges(triangles)) + len(triangles)) // 2


def with_node_count(points: np.ndarray, triangles: np.ndarray, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """The triangulation after its longest edges are split or its shortest ones collapsed, until it has `nodes` nodes,
    or as near as is possible where the neighbourhood of an edit is not edited again."""
    split = len(points) < nodes
    edges = pick_edges(points, triangles, abs(len(points) - nodes), split)
    for k in range(len(edges)):
        if split:
            points, triangles = split_edge(points, triangles, edges[k])
        else:
            points, triangles = collapse_edge(points, triangles, edges[k])
            # A collapse renumbers the nodes after the removed one.
            edges = edges - (edges > edges[k, 1])
    return points, triangles


def pick_edges(points: np.ndarray, triangles: np.ndarray, most: int, split: bool) -> np.ndarray:
    """Up to `most` edges, shape (e, 2), whose neighbourhoods are disjoint: the longest to split, or the shortest to
    collapse. After a split the opposite nodes have at most 7 edges. After a collapse they have at least 4, and the
    merged node at most 7."""
    edges = unique_edges(triangles)
    valence = np.bincount(edges.ravel(), minlength=len(points))
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    around = np.argsort(triangles.ravel(), kind="stable") // 3
    start = np.concatenate([[0], np.cumsum(np.bincount(triangles.ravel(), minlength=len(points)))])
    touched = np.zeros(len(points), bool)
    picked = []
    for edge in edges[np.argsort(-length if split else length, kind="stable")]:
        if len(picked) == most:
            break
        one, other = (np.unique(triangles[around[start[node] : start[node + 1]]]) for node in edge)
        near = np.union1d(one, other)
        if touched[near].any():
            continue
        shared = np.intersect1d(one, other)
        opposite = shared[(shared != edge[0]) & (shared != edge[1])]
        # A collapse keeps the surface a manifold only if the ends share exactly the two opposite nodes.
        collapsible = len(shared) == 4 and valence[edge].sum() - 4 <= 7 and (valence[opposite] >= 5).all()
        if (valence[opposite] <= 6).all() if split else collapsible:
            picked.append(edge)
            touched[near] = True
    return np.array(picked, dtype=np.int64).reshape(-1, 2)


def split_edge(points: np.ndarray, triangles: np.ndarray, edge: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The surface with a node in the middle of the edge, the last one; the two triangles of the edge become four."""
    middle = len(points)
    both = np.isin(triangles, edge).sum(axis=1) == 2
    halves = [np.where(triangles[both] == node, middle, triangles[both]) for node in edge]
    return np.vstack([points, points[edge].mean(axis=0)]), np.vstack([triangles[~both], *halves])


def collapse_edge(points: np.ndarray, triangles: np.ndarray, edge: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The surface with the ends of the edge merged in its middle; the two triangles of the edge are removed."""
    keep, drop = edge
    points = points.copy()
    points[keep] = points[edge].mean(axis=0)
    left = triangles[np.isin(triangles, edge).sum(axis=1) < 2]
    left = np.where(left == drop, keep, left)
    return np.delete(points, drop, axis=0), left - (left > drop)


def flip_edges(
    points: np.ndarray, triangles: np.ndarray, edges: np.ndarray, allowed: Callable[[int, int], bool], floor: float
) -> np.ndarray:
    """The triangles with each of the edges (e, 2) flipped in its quadrilateral, if no edge joins the opposite nodes k,
    l yet and `allowed(k, l)`, if both new triangles have at least the radius ratio `floor` or 0.01 more than the worse
    old one, and if their normals are within 60 degrees of the sum of the old ones."""
    triangles = triangles.copy()
    for i, j in edges:
        rows = np.flatnonzero(np.isin(triangles, (i, j)).sum(axis=1) == 2)
        if len(rows) != 2:
            continue
        old = triangles[rows]
        # The triangle that runs along i -> j comes first.
        forward = [(np.roll(row, -1) == j)[row == i].any() for row in old]
        k, m = (np.setdiff1d(row, (i, j))[0] for row in (old if forward[0] else old[::-1]))
        if not allowed(k, m) or (np.isin(triangles, (k, m)).sum(axis=1) == 2).any():
            continue
        new = np.array([[i, m, k], [m, j, k]])
        outward = triangle_normals(points, old).sum(axis=0)
        normals = triangle_normals(points, new)
        same_way = normals @ outward > 0.5 * np.linalg.norm(normals, axis=1) * np.linalg.norm(outward)
        target = min(floor, triangle_radius_ratio(points, old).min() + 0.01)
        if same_way.all() and triangle_radius_ratio(points, new).min() >= target:
            triangles[rows] = new
    return triangles
