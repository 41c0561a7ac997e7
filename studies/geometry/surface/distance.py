"""Distances between surfaces."""

import numpy as np
from scipy.spatial import KDTree

CANDIDATES = 24
"""Triangles looked at first per point, by their centroids: more than twice the six around a node of a graded mesh."""
BLOCK = 100_000
"""Pairs of point and triangle worked on at once: some tens of megabytes."""
FLAT = 1e-20
"""Squared sine of the angle at a corner under which a triangle is a line: its normal would be rounding."""


def distance_to_surface(queries: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Distance [m] of each of `queries` (q, 3) to the surface `triangles` (f, 3) on `points` (n, 3), (q,)."""
    corners = points[triangles]
    centroids = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centroids[:, None], axis=2).max()
    tree = KDTree(centroids)
    found = np.empty(len(queries))
    pending, count = np.arange(len(queries)), min(CANDIDATES, len(triangles))
    while len(pending):
        away, near = (a.reshape(len(pending), -1) for a in tree.query(queries[pending], k=count))
        found[pending] = _to_triangles(queries[pending], corners, near)
        if count == len(triangles):
            break
        # A triangle not looked at has its centroid beyond the last one's, and no point nearer than that less `reach`.
        pending = pending[away[:, -1] - reach < found[pending]]
        count = min(2 * count, len(triangles))
    return found


def _to_triangles(queries: np.ndarray, corners: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Smallest distance [m] of each query (q, 3) to its triangles `near` (q, k) of `corners` (f, 3, 3), (q,)."""
    rows = max(1, BLOCK // near.shape[1])
    found = np.empty(len(queries))
    for first in range(0, len(queries), rows):
        part = slice(first, first + rows)
        a, b, c = (corners[near[part], corner] for corner in range(3))
        found[part] = np.sqrt(_squared_to_triangle(queries[part, None, :], a, b, c).min(axis=1))
    return found


def hausdorff(points_a: np.ndarray, triangles_a: np.ndarray, points_b: np.ndarray, triangles_b: np.ndarray) -> float:
    """Symmetric Hausdorff distance [m] of two surfaces, seen from the nodes of each."""
    from_a = distance_to_surface(points_a[np.unique(triangles_a)], points_b, triangles_b)
    from_b = distance_to_surface(points_b[np.unique(triangles_b)], points_a, triangles_a)
    return float(max(from_a.max(), from_b.max()))


def _dot(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.einsum("...i,...i->...", u, v)


def _squared_to_segment(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    along = b - a
    share = np.clip(_dot(p - a, along) / np.maximum(_dot(along, along), 1e-300), 0.0, 1.0)
    rest = p - a - share[..., None] * along
    return _dot(rest, rest)


def _squared_to_triangle(p: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Squared distance to the face where p projects into it, else to the nearest edge."""
    u, v, w = b - a, c - a, p - a
    uu, uv, vv, wu, wv = _dot(u, u), _dot(u, v), _dot(v, v), _dot(w, u), _dot(w, v)
    normal = np.cross(u, v)
    square = _dot(normal, normal)
    solid = square > FLAT * uu * vv
    square = np.where(solid, square, 1.0)
    s, t = (vv * wu - uv * wv) / square, (uu * wv - uv * wu) / square
    height = _dot(w, normal) ** 2 / square
    edges = np.minimum(
        np.minimum(_squared_to_segment(p, a, b), _squared_to_segment(p, b, c)), _squared_to_segment(p, c, a)
    )
    return np.where(solid & (s >= 0) & (t >= 0) & (s + t <= 1), height, edges)
