"""Volumes of quadratic tetrahedra, per vertex or per element, summed over points inside them, and closed surfaces.

V_r = Σ_q ρ_rq w_q J_q with J_q = det F_q at the points q of the elements, Σ_r ρ_rq = 1 (docs/theory.md, eq. 8.9):
with ρ_rq the linear shape function of vertex r it is the pressure space of Taylor and Hood (1973). Where the four
corners of an element name one volume, its ρ is 1: a constant pressure in the element.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array, vstack

from massspring.body.volumes import Volumes
from massspring.kernels.points.jacobians import jacobians_into

PAIRS = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
"""Corners next to each mid-side node, in VTK's order of a quadratic tetrahedron."""
POINTS = 4
"""Of an element: exact for polynomials of second degree (Hammer, Marlowe, Stroud 1956)."""
FAR, NEAR = (5.0 - np.sqrt(5.0)) / 20.0, (5.0 + 3.0 * np.sqrt(5.0)) / 20.0
BARYCENTRIC = np.full((POINTS, 4), FAR) + (NEAR - FAR) * np.eye(POINTS)
"""Linear shape functions of the corners at the points, (4, 4); also ρ."""


def _local_slopes() -> np.ndarray:
    """∂N_a/∂b_i at the points, (4, 10, 4): N = b (2b − 1) at corners, 4 b_i b_j between."""
    slopes = np.zeros((POINTS, 10, 4))
    corner = np.arange(4)
    slopes[:, corner, corner] = 4.0 * BARYCENTRIC - 1.0
    for a, (i, j) in enumerate(PAIRS, start=4):
        slopes[:, a, i], slopes[:, a, j] = 4.0 * BARYCENTRIC[:, j], 4.0 * BARYCENTRIC[:, i]
    return slopes


SLOPES = _local_slopes()[:, :, 1:] - _local_slopes()[:, :, :1]
"""∂N_a/∂(b_2, b_3, b_4) with b_1 = 1 − b_2 − b_3 − b_4, (4, 10, 3)."""


def gradients(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """∇N_a [1/m] at the points of `cells` (k, 10) with nodes at `points` (n, 3) [m], (k, 4, 10, 3), and the weights
    det/24 of the points [m³], (k, 4)."""
    jacobian = np.einsum("kai,qaj->kqij", points[cells], SLOPES)
    return np.einsum("qaj,kqji->kqai", SLOPES, np.linalg.inv(jacobian)), np.linalg.det(jacobian) / 24.0


@dataclass(frozen=True, eq=False)
class PointVolumes:
    """m volumes of k quadratic tetrahedra: of vertices, then of the elements that keep their own, each in ascending
    order, then of closed surfaces such as a lumen."""

    cells: np.ndarray
    """VTK's order, (k, 10) uint32."""
    gradient: np.ndarray
    """∇N_a at the points at rest [1/m], (k, 4, 10, 3)."""
    weight: np.ndarray
    """w_q [m³], (k, 4); their sum is the rest volume."""
    corner_volume: np.ndarray
    """The volume of each corner of each element, (k, 4); one and the same at all corners of an element with its own."""
    closed: Volumes | None = None
    """Further volumes inside closed surfaces of flat triangles."""

    @cached_property
    def tissue_count(self) -> int:
        """Number of volumes of the tissue: of vertices and of elements."""
        return int(self.corner_volume.max()) + 1

    @cached_property
    def own(self) -> np.ndarray:
        """The elements that keep a volume of their own, ascending, (e,)."""
        return np.flatnonzero(np.ptp(self.corner_volume, axis=1) == 0)

    @property
    def names(self) -> tuple[str, ...]:
        """m different names."""
        vertices = tuple(f"vertex {r}" for r in range(self.tissue_count - len(self.own)))
        tissue = vertices + tuple(f"element {e}" for e in self.own)
        return tissue if self.closed is None else tissue + self.closed.names

    @property
    def count(self) -> int:
        """m."""
        return self.tissue_count + (0 if self.closed is None else self.closed.count)

    @property
    def highest_node(self) -> int:
        """Largest node number in use."""
        return int(self.cells.max())

    def deformation(self, x: np.ndarray) -> np.ndarray:
        """F_q = Σ_a x_a ⊗ ∇N_a [1] at positions `x` (n, 3) [m], (k, 4, 3, 3)."""
        columns = np.swapaxes(self.gradient, 2, 3) @ x[self.cells][:, None]
        return np.swapaxes(columns, 2, 3)

    def jacobians(self, x: np.ndarray) -> np.ndarray:
        """J_q = det F_q [1], (k, 4)."""
        out = np.empty(self.weight.shape)
        jacobians_into(np.ascontiguousarray(x, dtype=np.float64), self.cells, SLOPES, self.weight, out)
        return out

    def measure(self, x: np.ndarray) -> np.ndarray:
        """V_r [m³] at positions `x` (n, 3) [m], (m,)."""
        return self.volumes_of(self.jacobians(x), x)

    def volumes_of(self, j: np.ndarray, x: np.ndarray) -> np.ndarray:
        """V_r [m³] of J_q (k, 4) at positions `x` (n, 3) [m], (m,)."""
        parts = np.einsum("kq,qr->kr", self.weight * j, BARYCENTRIC)
        own = np.bincount(self.corner_volume.ravel(), weights=parts.ravel(), minlength=self.tissue_count)
        return own if self.closed is None else np.concatenate([own, self.closed.measure(x)])

    def jacobian(self, x: np.ndarray) -> csr_array:
        """J_r = ∂V_r/∂x [m²] at positions `x` (n, 3) [m], (m, 3n): Σ_q ρ_rq w_q cof F_q ∇N_a."""
        areas = self.areas(x)
        entry = np.einsum("kqai,qr->krai", areas, BARYCENTRIC)
        rows = np.broadcast_to(self.corner_volume[:, :, None, None], entry.shape)
        columns = 3 * self.cells.astype(np.int64)[:, None, :, None] + np.arange(3)
        shape = (self.tissue_count, x.size)
        own = csr_array((entry.ravel(), (rows.ravel(), np.broadcast_to(columns, entry.shape).ravel())), shape=shape)
        own.sum_duplicates()
        return own if self.closed is None else csr_array(vstack([own, self.closed.jacobian(x)]))

    def areas(self, x: np.ndarray) -> np.ndarray:
        """D_qa = w_q cof F_q ∇N_a [m²], (k, 4, 10, 3): what moving node a adds to w_q J_q."""
        f = self.deformation(x)
        columns = [np.cross(f[..., :, i], f[..., :, j]) for i, j in ((1, 2), (2, 0), (0, 1))]
        return self.weight[:, :, None, None] * np.einsum("kqij,kqaj->kqai", np.stack(columns, axis=-1), self.gradient)

    def parts_of(self, triangles: np.ndarray) -> np.ndarray:
        """Factor of each volume in the volume of the tissue, (m,): 1 in the tissue, 0 for closed surfaces."""
        return np.r_[np.ones(self.tissue_count), np.zeros(self.count - self.tissue_count)]

    def renumbered(self, number: np.ndarray) -> "PointVolumes":
        """The same volumes in the same order, with node i renumbered to `number[i]`, (n,) uint32."""
        closed = None if self.closed is None else self.closed.renumbered(number)
        return replace(self, cells=number[self.cells], closed=closed)
