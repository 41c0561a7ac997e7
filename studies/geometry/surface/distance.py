"""Distances between surfaces."""

import numpy as np
from scipy.spatial import KDTree

CANDIDATES = 12
"""Triangles with the nearest centroids that are tested first per point: twice the six around a node. The distance does
not depend on this number; with a smaller one more points are tested again."""


class SurfaceDistance:
    """Distances of any number of sets of points to one surface."""

    def __init__(self, points: np.ndarray, triangles: np.ndarray):
        """Points (n, 3) [m] and triangles (f, 3) of the surface."""
        self.corners = np.asarray(points, float)[triangles]
        centroids = self.corners.mean(axis=1)
        self.reach = np.linalg.norm(self.corners - centroids[:, None], axis=2).max()
        self.tree = KDTree(centroids)

    def __call__(self, queries: np.ndarray) -> np.ndarray:
        """Distance [m] of each of the points `queries` (q, 3) [m], shape (q,)."""
        return self.nearest(queries)[0]

    def nearest(self, queries: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance [m] of each of the points `queries` (q, 3) [m], and the index of its nearest triangle, both (q,)."""
        distance, nearest, total = np.empty(len(queries)), np.empty(len(queries), np.int64), len(self.corners)
        pending, count = np.arange(len(queries)), min(CANDIDATES, total)
        while len(pending):
            away, near = (a.reshape(len(pending), -1) for a in self.tree.query(queries[pending], k=count))
            distance[pending], nearest[pending] = _to_triangles(queries[pending], self.corners, near)
            if count == total:
                break
            # The centroid of any other triangle is at least as far as the last one, so the triangle is farther than
            # that distance minus reach.
            pending = pending[away[:, -1] - self.reach < distance[pending]]
            count = min(2 * count, total)
        return distance, nearest


class ChangingFacets:
    """Distances in both directions between a fixed surface and one of which few facets change from call to call."""

    def __init__(self, points: np.ndarray, triangles: np.ndarray):
        """Points (n, 3) [m] and triangles (f, 3) of the fixed surface."""
        self.samples, self.fixed = points, SurfaceDistance(points, triangles)
        self.rows: dict[bytes, int] = {}
        self.ahead, self.owner = np.empty(len(points)), np.full(len(points), -1)
        self.behind: np.ndarray | None = None

    def measure(self, places: np.ndarray, pieces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distances [m] of the points of the fixed surface to the other one, (n,), and of `places` to the fixed
        surface, (t, p), equal to those of SurfaceDistance bit for bit.

        places: p points on each of t facets of the other surface, (t, p, 3) [m]; pieces: flat triangles between the
        points of one facet, (k, 3).
        """
        keys = [facet.tobytes() for facet in places]
        before = np.array([self.rows.get(key, -1) for key in keys])
        new, kept = np.flatnonzero(before < 0), np.flatnonzero(before >= 0)
        behind = np.empty(places.shape[:2])
        if self.behind is not None:
            behind[kept] = self.behind[before[kept]]
        behind[new] = self.fixed(places[new].reshape(-1, 3)).reshape(len(new), places.shape[1])
        # Row of each facet of the last call among those of this call; -1 for a facet that is gone.
        after = np.full(len(self.rows) + 1, -1)
        after[before[kept]] = kept
        owner, ahead = after[self.owner], self.ahead.copy()
        lost = np.flatnonzero(owner < 0)
        if len(lost):
            ahead[lost], piece = SurfaceDistance(*_apart(places, pieces)).nearest(self.samples[lost])
            owner[lost] = piece // len(pieces)
        if len(new) and len(lost) < len(owner):
            changed = SurfaceDistance(*_apart(places[new], pieces))
            near = np.flatnonzero(changed.tree.query(self.samples)[0] - changed.reach < ahead)
            away, piece = changed.nearest(self.samples[near])
            nearer = away < ahead[near]
            ahead[near[nearer]], owner[near[nearer]] = away[nearer], new[piece[nearer] // len(pieces)]
        self.rows = {key: k for k, key in enumerate(keys)}
        self.ahead, self.owner, self.behind = ahead, owner, behind
        return ahead, behind


def _apart(places: np.ndarray, pieces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (t p, 3) and triangles (t k, 3) of facets with places (t, p, 3), which share no point."""
    first = places.shape[1] * np.arange(len(places))
    return places.reshape(-1, 3), (pieces + first[:, None, None]).reshape(-1, 3)


def distance_to_surface(queries: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Distance [m], shape (q,), of `queries` (q, 3) [m] to the surface of points (n, 3) [m] and triangles (f, 3)."""
    return SurfaceDistance(points, triangles)(queries)


def _to_triangles(queries: np.ndarray, corners: np.ndarray, near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smallest distance [m] of each query (q, 3) to its triangles `near` (q, k) of `corners` (f, 3, 3), and the index
    of that triangle, both (q,)."""
    # Imported here, because compiled code takes half a second to import.
    from studies.geometry.surface.triangle_distance import nearest_into

    squared, nearest = np.empty(len(queries)), np.empty(len(queries), np.int64)
    nearest_into(np.ascontiguousarray(queries, float), corners, near, np.empty((3, 3)), squared, nearest)
    return np.sqrt(squared), nearest


def hausdorff(points_a: np.ndarray, triangles_a: np.ndarray, points_b: np.ndarray, triangles_b: np.ndarray) -> float:
    """Symmetric Hausdorff distance [m] of two surfaces, measured at the nodes of each: a lower bound."""
    from_a = distance_to_surface(points_a[np.unique(triangles_a)], points_b, triangles_b)
    from_b = distance_to_surface(points_b[np.unique(triangles_b)], points_a, triangles_a)
    return float(max(from_a.max(), from_b.max()))
