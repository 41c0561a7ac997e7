"""Small edits of a closed triangulation: nodes added, removed, edges turned."""

from collections.abc import Callable

import numpy as np

from studies.geometry.mesh import triangle_normals, unique_edges
from studies.geometry.quality import triangle_radius_ratio


def with_node_count(points: np.ndarray, triangles: np.ndarray, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """The triangulation with exactly `nodes` nodes where it allows: longest edges split or shortest ones collapsed.

    Edits keep to themselves: the neighbourhood of one is not edited again. Returns as near as that permits.
    """
    touched = np.zeros(len(points), bool)
    while len(points) != nodes:
        edge = pick_edge(points, triangles, touched, split=len(points) < nodes)
        if edge is None:
            break
        near = np.unique(triangles[np.isin(triangles, edge).any(axis=1)])
        touched[near] = True
        if len(points) < nodes:
            points, triangles = split_edge(points, triangles, edge)
            touched = np.append(touched, True)
        else:
            points, triangles = collapse_edge(points, triangles, edge)
            touched = np.delete(touched, edge[1])
    return points, triangles


def pick_edge(points: np.ndarray, triangles: np.ndarray, touched: np.ndarray, split: bool) -> np.ndarray | None:
    """The longest edge to split or the shortest to collapse that leaves 4 to 7 edges at every node around."""
    edges = unique_edges(triangles)
    valence = np.bincount(edges.ravel(), minlength=len(points))
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    for edge in edges[np.argsort(-length if split else length, kind="stable")]:
        if touched[edge].any():
            continue
        fans = triangles[np.isin(triangles, edge).sum(axis=1) == 2]
        opposite = np.setdiff1d(fans, edge)
        if split:
            if (valence[opposite] <= 6).all():
                return edge
            continue
        one, other = (np.unique(triangles[(triangles == node).any(axis=1)]) for node in edge)
        # A collapse keeps the surface a manifold only where the ends share exactly the two opposite nodes.
        shared = np.intersect1d(one, other)
        if len(shared) == 4 and valence[edge].sum() - 4 <= 7 and (valence[opposite] >= 5).all():
            return edge
    return None


def split_edge(points: np.ndarray, triangles: np.ndarray, edge: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A node in the middle of the edge; its two triangles become four."""
    middle = len(points)
    both = np.isin(triangles, edge).sum(axis=1) == 2
    halves = [np.where(triangles[both] == node, middle, triangles[both]) for node in edge]
    return np.vstack([points, points[edge].mean(axis=0)]), np.vstack([triangles[~both], *halves])


def collapse_edge(points: np.ndarray, triangles: np.ndarray, edge: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The edge's ends become one node in its middle; its two triangles vanish."""
    keep, drop = edge
    points = points.copy()
    points[keep] = points[edge].mean(axis=0)
    left = triangles[np.isin(triangles, edge).sum(axis=1) < 2]
    left = np.where(left == drop, keep, left)
    return np.delete(points, drop, axis=0), left - (left > drop)


def flip_edges(
    points: np.ndarray, triangles: np.ndarray, edges: np.ndarray, allowed: Callable[[int, int], bool], floor: float
) -> np.ndarray:
    """The triangles with each of the edges (e, 2) turned in its quadrilateral, where that helps.

    It helps when the new edge is new and `allowed(k, l)`, when the two new triangles are better than the worse old one
    or than `floor`, and when they look the same way (within 60 degrees of the old ones together).
    """
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
