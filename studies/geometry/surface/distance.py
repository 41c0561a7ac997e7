"""Distances between surfaces."""

import numpy as np
from scipy.spatial import KDTree

CANDIDATES = 12
"""Triangles looked at first per point, by their centroids: twice the six around a node. The distance does not depend on
it; with fewer, more points are looked at again."""


class SurfaceDistance:
    """Distances to one surface, of as many sets of points as wanted."""

    def __init__(self, points: np.ndarray, triangles: np.ndarray):
        """points (n, 3) [m], triangles (f, 3)."""
        self.corners = np.asarray(points, float)[triangles]
        centroids = self.corners.mean(axis=1)
        self.reach = np.linalg.norm(self.corners - centroids[:, None], axis=2).max()
        self.tree = KDTree(centroids)
        self.known: dict[bytes, float] = {}

    def __call__(self, queries: np.ndarray) -> np.ndarray:
        """Distance [m] of each of `queries` (q, 3), (q,)."""
        found, total = np.empty(len(queries)), len(self.corners)
        pending, count = np.arange(len(queries)), min(CANDIDATES, total)
        while len(pending):
            away, near = (a.reshape(len(pending), -1) for a in self.tree.query(queries[pending], k=count))
            found[pending] = _to_triangles(queries[pending], self.corners, near)
            if count == total:
                break
            # A triangle not looked at has its centroid beyond the last one's, and no point nearer than that less reach.
            pending = pending[away[:, -1] - self.reach < found[pending]]
            count = min(2 * count, total)
        return found

    def again(self, queries: np.ndarray) -> np.ndarray:
        """The same; what the call before asked for too, to the bit, is not measured again."""
        keys = np.ascontiguousarray(queries, float).view("V24").ravel().tolist()
        new = [k for k, key in enumerate(keys) if key not in self.known]
        measured = dict(zip([keys[k] for k in new], self(queries[new]).tolist(), strict=True)) if new else {}
        found = [self.known[key] if key in self.known else measured[key] for key in keys]
        self.known = dict(zip(keys, found, strict=True))
        return np.array(found)


def distance_to_surface(queries: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Distance [m] of each of `queries` (q, 3) to the surface `triangles` (f, 3) on `points` (n, 3), (q,)."""
    return SurfaceDistance(points, triangles)(queries)


def _to_triangles(queries: np.ndarray, corners: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Smallest distance [m] of each query (q, 3) to its triangles `near` (q, k) of `corners` (f, 3, 3), (q,)."""
    # Loaded where it is used: what compiles takes half a second to import.
    from studies.geometry.surface.triangle_distance import nearest_into

    found = np.empty(len(queries))
    nearest_into(np.ascontiguousarray(queries, float), corners, near, np.empty((3, 3)), found)
    return np.sqrt(found)


def hausdorff(points_a: np.ndarray, triangles_a: np.ndarray, points_b: np.ndarray, triangles_b: np.ndarray) -> float:
    """Symmetric Hausdorff distance [m] of two surfaces, seen from the nodes of each."""
    from_a = distance_to_surface(points_a[np.unique(triangles_a)], points_b, triangles_b)
    from_b = distance_to_surface(points_b[np.unique(triangles_b)], points_a, triangles_a)
    return float(max(from_a.max(), from_b.max()))
