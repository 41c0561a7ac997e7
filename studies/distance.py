"""Distances between surfaces."""

import numpy as np
from scipy.spatial import cKDTree

CANDIDATES = 24
"""Triangles looked at per point, by their centroids: more than twice the six around a node of a graded mesh."""


def distance_to_surface(queries: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Distance [m] of each of `queries` (q, 3) to the surface `triangles` (f, 3) on `points` (n, 3), (q,)."""
    corners = points[triangles]
    tree = cKDTree(corners.mean(axis=1))
    _, near = tree.query(queries, k=min(CANDIDATES, len(triangles)))
    a, b, c = (corners[near.reshape(len(queries), -1)][:, :, corner] for corner in range(3))
    return np.sqrt(_squared_to_triangle(queries[:, None, :], a, b, c).min(axis=1))


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
    det = np.maximum(uu * vv - uv * uv, 1e-300)
    s, t = (vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det
    normal = np.cross(u, v)
    height = _dot(w, normal) ** 2 / np.maximum(_dot(normal, normal), 1e-300)
    edges = np.minimum(
        np.minimum(_squared_to_segment(p, a, b), _squared_to_segment(p, b, c)), _squared_to_segment(p, c, a)
    )
    return np.where((s >= 0) & (t >= 0) & (s + t <= 1), height, edges)
