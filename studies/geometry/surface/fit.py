"""A surface mesh brought nearer to its shape where even nodes cut corners: thin margins, tips, the floor of folds."""

import numpy as np

from studies.geometry.mesh.organ_mesh import triangle_normals, unique_edges
from studies.geometry.mesh.quality import triangle_radius_ratio
from studies.geometry.shape.levelset import Shape, project
from studies.geometry.surface.distance import distance_to_surface
from studies.geometry.surface.edit import split_edge, with_node_count
from studies.geometry.surface.intersections import crossing_triangles
from studies.geometry.surface.node_count import FEWEST, MOST
from studies.geometry.surface.repair import edge_pairs

Surface = tuple[np.ndarray, np.ndarray]

SPARE = 0.04
"""Share of the nodes that is put where the evenly spread ones leave the mesh farthest from its shape."""
ALLOWED = 0.01
"""Deviation over the diagonal at which no node is added for the sake of the shape: a third of what is promised."""
FLOOR = 0.3
"""Smallest radius ratio of a triangle that a new node may make; the fill still has good elements above 0.2."""
POOR = 0.2
"""Smallest radius ratio that putting nodes back may leave: that of an even mesh (count.QUALITY)."""
SHARPEST = -0.5
"""Cosine between the normals of neighbours, 120 degrees, beyond which a new node may not fold them: slivers follow."""


def evenly_spread(nodes: int) -> int:
    """How many of `nodes` nodes are spread evenly; SPARE of them are left for where they are needed."""
    return max(FEWEST, round((1.0 - SPARE) * nodes)) if FEWEST <= nodes <= MOST else nodes


def followed(shape: Shape, points: np.ndarray, triangles: np.ndarray, samples: np.ndarray, nodes: int) -> Surface:
    """An even surface on f = 0 brought near to its shape, with `nodes` nodes where single edits allow that.

    points (n, 3) [m], triangles (t, 3); samples (m, 3) [m] on f = 0, finer than the mesh.
    """
    points, triangles = refined(points, triangles, samples, nodes)
    points, triangles = with_node_count(points, triangles, nodes)
    return unspoilt(points, project(shape, points), triangles), triangles


def refined(points: np.ndarray, triangles: np.ndarray, samples: np.ndarray, nodes: int) -> Surface:
    """The mesh with further nodes, up to `nodes`, each at the sample that is then farthest from the mesh.

    points (n, 3) [m], triangles (t, 3), samples (m, 3) [m] on the shape. The edge whose middle is nearest to the sample
    is split; a node that spoils the mesh stays in that middle. Stops early where all samples are within ALLOWED of the
    diagonal.
    """
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    middles = points
    # Only what is far may get farther away; fine samples are many.
    samples = samples[distance_to_surface(samples, points, triangles) > 0.5 * ALLOWED * diagonal]
    while len(points) < nodes and len(samples):
        away = distance_to_surface(samples, points, triangles)
        order = np.argsort(-away)[: nodes - len(points)]
        if away[order[0]] <= ALLOWED * diagonal:
            break
        for sample in samples[order]:
            edges = unique_edges(triangles)
            edge = edges[np.linalg.norm(points[edges].mean(axis=1) - sample, axis=1).argmin()]
            split, more = split_edge(points, triangles, edge)
            split[-1] = sample
            around = more[(more == len(points)).any(axis=1)]
            if triangle_radius_ratio(split, around).min() > FLOOR:
                middles = np.vstack([middles, middles[edge].mean(axis=0)])
                points, triangles = split, more
                break
        else:
            break
    return unspoilt(middles, points, triangles), triangles


def unspoilt(before: np.ndarray, after: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """`after`, but with nodes of triangles that cross, fold back or flatten put to where they were, if they moved."""
    after = after.copy()
    while True:
        bad = np.concatenate([crossing_triangles(after, triangles), folded_pairs(after, triangles)])
        poor = np.flatnonzero(triangle_radius_ratio(after, triangles) < POOR)
        nodes = np.unique(triangles[np.concatenate([bad.ravel(), poor])])
        moved = nodes[(after[nodes] != before[nodes]).any(axis=1)]
        if not len(moved):
            return after
        after[moved] = before[moved]


def folded_pairs(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Pairs (p, 2) of neighbouring triangles whose normals are farther apart than SHARPEST."""
    normals = triangle_normals(points, triangles)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    pairs, _ = edge_pairs(triangles)
    return pairs[(normals[pairs[:, 0]] * normals[pairs[:, 1]]).sum(axis=1) < SHARPEST]
