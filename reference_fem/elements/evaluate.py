"""Displacement at any material point."""

import numpy as np
from scipy.spatial import KDTree
from skfem import ElementTetP2, MeshTet

from reference_fem.elements.shapes import basis_table, element_nodes, nodes
from reference_fem.errors import SolveError

INSIDE = -1e-9
"""Least barycentric coordinate of a point that counts as inside an element: round-off of the inverse map."""


class Evaluator:
    """Finds rest points in a mesh once per call and interpolates P2 fields there.

    A point outside is extrapolated from the nearest element; `outside` holds the distances of the last call (M,) [m],
    zero for points inside (measured along the element's own axes: in a skew element more than the true distance).
    Raises SolveError for a point farther out than max_outside [m] (default: 5 % of the diagonal of the box).
    """

    def __init__(self, mesh: MeshTet, max_outside: float | None = None):
        self.x, self.table = nodes(mesh), element_nodes(mesh)
        self.corners = self.x[self.table[:, :4]]
        self.tree = KDTree(self.corners.mean(axis=1))
        size = np.linalg.norm(np.ptp(self.x, axis=0))
        self.max_outside = 0.05 * size if max_outside is None else max_outside
        self.outside = np.zeros(0)

    def displacement(self, u: np.ndarray, points: np.ndarray):
        """u: (N2, 3) nodal field; points: (M, 3) rest positions [m]; returns (M, 3)."""
        element, local = self.locate(points)
        values, _ = basis_table(ElementTetP2(), local.T)
        return np.einsum("ma,mai->mi", values, np.asarray(u)[self.table[element]])

    def locate(self, points: np.ndarray):
        """(element (M,), reference coordinates (M, 3)); fills `outside`."""
        points = np.atleast_2d(np.asarray(points, dtype=float))
        if points.shape[1:] != (3,) or not np.isfinite(points).all():
            raise SolveError(f"points of shape {points.shape} are to be evaluated: give finite (M, 3) values [m]")
        element, local = np.zeros(len(points), dtype=np.int64), np.zeros((len(points), 3))
        self.outside, open_ = np.full(len(points), np.inf), np.arange(len(points))
        for count in (8, 32, 128):
            self.improve(points, open_, count, (element, local))
            open_ = np.flatnonzero(self.outside > 0.0)
            if open_.size == 0:
                return element, local
        worst = int(np.argmax(self.outside))
        if self.outside[worst] > self.max_outside:
            raise SolveError(
                f"point {worst} at {points[worst]} lies {self.outside[worst]:.3g} m outside the mesh (limit "
                f"{self.max_outside:.3g} m): give rest positions in metres, inside the body"
            )
        return element, local

    def improve(self, points: np.ndarray, open_: np.ndarray, count: int, places: tuple[np.ndarray, np.ndarray]):
        """Try the `count` elements with the nearest centroids for the open points, keep the closest of each."""
        element, local = places
        count = min(count, len(self.table))
        _, near = self.tree.query(points[open_], k=count)
        for candidate in near.reshape(len(open_), count).T:
            reference = self.invert(candidate, points[open_])
            distance = self.distances(points[open_], candidate, reference)
            better = distance < self.outside[open_]
            where = open_[better]
            element[where], local[where], self.outside[where] = candidate[better], reference[better], distance[better]

    def invert(self, element: np.ndarray, points: np.ndarray):
        """Reference coordinates of points in the (curved) elements, by Newton from the straight map.

        Points farther than one element's size keep the straight map's: their element is not the nearest.
        """
        corners = self.corners[element]
        edges = (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
        local = np.linalg.solve(edges, (points - corners[:, 0])[:, :, None])[:, :, 0]
        near = np.flatnonzero((np.abs(local - 0.5) <= 1.5).all(axis=1))
        reach, x, target = local[near], self.x[self.table[element[near]]], points[near]
        for _ in range(8):
            values, gradients = basis_table(ElementTetP2(), reach.T)
            gap = target - np.einsum("ma,mai->mi", values, x)
            slope = np.einsum("mai,mJa->miJ", x, gradients)
            move = np.linalg.solve(slope, gap[:, :, None])[:, :, 0]
            reach = np.clip(reach + move, -1.0, 2.0)
            if np.abs(move).max(initial=0.0) < 1e-13:
                break
        local[near] = reach
        return local

    def distances(self, points: np.ndarray, element: np.ndarray, local: np.ndarray):
        """Distance from each point to where its clipped reference coordinates lead [m]; zero inside."""
        inside = np.minimum(local.min(axis=1), 1.0 - local.sum(axis=1)) >= INSIDE
        clipped = np.clip(local, 0.0, 1.0)
        clipped /= np.maximum(1.0, clipped.sum(axis=1))[:, None]
        values, _ = basis_table(ElementTetP2(), clipped.T)
        near = np.einsum("ma,mai->mi", values, self.x[self.table[element]])
        return np.where(inside, 0.0, np.linalg.norm(points - near, axis=1))
