"""The dominant axis of a surface and the virtual nodes on it, ends of the inner springs (JHC05, section 3)."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from massspring.body.springs import EDGES_OF_TRIANGLE, lengths, unique_edges
from massspring.errors import MassSpringError

AXES = ("straight", "centre_line")
MIN_VIRTUAL_NODES = 2
BANDS = 12
"""Bands of the surface along a centre line: enough for a stomach's bend, wide enough for 150 nodes."""
FAR_SWEEPS = 4
"""Walks from a farthest node to the node farthest from it; on closed surfaces two or three find the diameter."""


def virtual_nodes(points: np.ndarray, triangles: np.ndarray, spacing: float, axis: str = "straight") -> np.ndarray:
    """Nodes [m], (a, 3), along the axis of a closed surface, about `spacing` [m] apart and in order.

    `points` (n, 3) [m], `triangles` (f, 3). The paper's axis follows "the organ's topology": "straight" suits a compact
    organ (ball, liver, spleen), "centre_line" a bent one (stomach). Raises MassSpringError for any other `axis`.
    """
    if axis == "straight":
        return _straight(points, spacing)
    if axis == "centre_line":
        return _centre_line(points, triangles, spacing)
    raise MassSpringError(f"unknown axis '{axis}'; known: {', '.join(AXES)}")


def principal_axis(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centre [m] and unit direction of largest spread of `points` (n, 3), both (3,)."""
    centre = points.mean(axis=0)
    _, directions = np.linalg.eigh(np.cov((points - centre).T))
    return centre, directions[:, -1]


def _even(low: float, high: float, spacing: float) -> np.ndarray:
    """Positions between low and high, about `spacing` apart and as far from either end as from each other."""
    count = max(MIN_VIRTUAL_NODES, round((high - low) / spacing) - 1)
    margin = (high - low) / (count + 1)
    return np.linspace(low + margin, high - margin, count)


def _straight(points: np.ndarray, spacing: float) -> np.ndarray:
    """Evenly on the principal axis."""
    centre, direction = principal_axis(points)
    along = (points - centre) @ direction
    return centre + _even(along.min(), along.max(), spacing)[:, None] * direction


def _centre_line(points: np.ndarray, triangles: np.ndarray, spacing: float) -> np.ndarray:
    """Evenly on the line through the centroids of bands of the surface, between its ends: the two nodes farthest apart.

    s = d_a/(d_a + d_b) of the distances along the surface grows from 0 at one end to 1 at the other; its level curves
    cut the organ across even where it bends, for both distances grow on the outside of a bend.
    """
    ends, from_a, from_b = _far_ends(points, triangles)
    s = from_a / (from_a + from_b)
    bands = np.arange(1, BANDS + 1) / (BANDS + 1)
    # Bands overlap by half: one that holds few nodes would let its centroid jump about.
    weight = _node_areas(points, triangles) * np.clip(1.0 - np.abs(s - bands[:, None]) * (BANDS + 1), 0.0, None)
    filled = weight.sum(axis=1) > 0
    centroids = (weight[filled] @ points) / weight[filled].sum(axis=1)[:, None]
    line = np.vstack([points[ends[0]], centroids, points[ends[1]]])
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = _even(0.0, arc[-1], spacing)
    return np.stack([np.interp(at, arc, line[:, axis]) for axis in range(3)], axis=1)


def _far_ends(points: np.ndarray, triangles: np.ndarray) -> tuple[tuple[int, int], np.ndarray, np.ndarray]:
    """The two nodes farthest apart along the edges, and the distances from either [m], both (n,)."""
    edges = unique_edges(triangles, EDGES_OF_TRIANGLE).astype(np.int64)
    graph = coo_array((lengths(points, edges), (edges[:, 0], edges[:, 1])), shape=(len(points), len(points))).tocsr()
    end, start = 0, 0
    for _ in range(FAR_SWEEPS):
        start, end = end, int(np.argmax(dijkstra(graph, directed=False, indices=end)))
    here, there = dijkstra(graph, directed=False, indices=[start, end])
    if not np.isfinite(here).all():
        raise MassSpringError("the surface has separate parts; a centre line needs one")
    return (start, end), here, there


def _node_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """A third of the adjacent triangles' area [m²], (n,)."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.bincount(triangles.ravel(), weights=np.repeat(area / 3.0, 3), minlength=len(points))


def closest_virtual_node(points: np.ndarray, virtual: np.ndarray) -> np.ndarray:
    """Index into `virtual` (a, 3) of the node closest to each of `points` (n, 3), (n,)."""
    return np.argmin(((points[:, None, :] - virtual[None, :, :]) ** 2).sum(axis=2), axis=1)
