"""A surface mesh brought nearer to its shape where it cuts corners: thin margins, tips, the floor of folds."""

import numpy as np
from scipy.spatial import KDTree

from studies.distance import distance_to_surface
from studies.geometry.edit import split_edge
from studies.geometry.levelset import Shape, project
from studies.geometry.mesh import unique_edges
from studies.geometry.quality import triangle_radius_ratio
from studies.geometry.snap import without_spoilers
from studies.geometry.surface import neighbour_mean

Surface = tuple[np.ndarray, np.ndarray]

ROUNDS = 6
SPARE = 0.04
"""Share of the nodes that is put where the evenly spread ones leave the mesh farthest from its shape."""
ALLOWED = 0.004
"""Deviation over the diagonal that is left alone: that of a sphere under edges of a tenth of its diameter."""
FLOOR = 0.3
"""Smallest radius ratio of a triangle that a move may leave behind; the fill still has good elements above 0.2."""


def refined(points: np.ndarray, triangles: np.ndarray, samples: np.ndarray, nodes: int) -> Surface:
    """The mesh with further nodes, up to `nodes`, each at the sample that is then farthest from the mesh.

    points (n, 3) [m], triangles (t, 3), samples (m, 3) [m] on the shape. The edge whose middle is nearest to the sample
    is split; stops early where all samples are within ALLOWED of the diagonal.
    """
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    while len(points) < nodes:
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
                points, triangles = split, more
                break
        else:
            break
    return points, triangles


def fitted(shape: Shape, points: np.ndarray, triangles: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Nodes moved along f = 0 to where the mesh is farthest from the shape.

    points (n, 3) [m] on f = 0, triangles (t, 3); samples (m, 3) [m] on f = 0, finer than the mesh. In each round the
    node nearest to each worst sample goes there, one for a neighbourhood; then the others even out. A move that spoils
    a triangle is taken back.
    """
    edges = unique_edges(triangles)
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    best, least = points, np.inf
    for _ in range(ROUNDS):
        away = distance_to_surface(samples, points, triangles)
        if away.max() < least:
            best, least = points, float(away.max())
        if away.max() <= ALLOWED * diagonal:
            break
        nodes, targets = pulls(points, edges, samples, away, ALLOWED * diagonal)
        moved = points.copy()
        moved[nodes] = samples[targets]
        pulled = without_spoilers(points, moved, triangles, FLOOR)
        free = np.setdiff1d(np.arange(len(points)), nodes)
        evened = pulled.copy()
        evened[free] = project(shape, (0.7 * pulled + 0.3 * neighbour_mean(pulled, edges))[free])
        points = without_spoilers(pulled, evened, triangles, FLOOR)
    away = distance_to_surface(samples, points, triangles)
    return points if away.max() < least else best


def pulls(
    points: np.ndarray, edges: np.ndarray, samples: np.ndarray, away: np.ndarray, allowed: float
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and the samples they go to: worst sample first, no two nodes that share an edge."""
    worst = np.flatnonzero(away > allowed)
    worst = worst[np.argsort(-away[worst], kind="stable")]
    _, nearest = KDTree(points).query(samples[worst])
    blocked = np.zeros(len(points), bool)
    neighbours = [[] for _ in points]
    for i, j in edges.tolist():
        neighbours[i].append(j)
        neighbours[j].append(i)
    nodes, targets = [], []
    for sample, node in zip(worst.tolist(), nearest.tolist(), strict=True):
        if not blocked[node]:
            nodes.append(node)
            targets.append(sample)
            blocked[node] = True
            blocked[neighbours[node]] = True
    return np.array(nodes, int), np.array(targets, int)
