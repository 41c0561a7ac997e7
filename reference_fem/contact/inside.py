"""Whether the middle of a sphere or capsule is inside the body: contact that keeps points of the surface out of an
obstacle pushes them to the far side once its middle has passed them."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from reference_fem.elements.surface import Surface
from reference_fem.model.obstacles import CAPSULE, PLANE


class Inside:
    """Finds obstacles in a body with the boundary `surface`; `rows` (no, 8) are where they start."""

    def __init__(self, surface: Surface, rows: np.ndarray):
        self.corners = (surface.dofs[:, :3] // 3).astype(np.int64)
        self.rest = surface.rest.reshape(-1, 3)
        ends, count = self.corners[:, [0, 1, 0, 2]].reshape(-1, 2), len(self.rest)
        links = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), (count, count))
        self.sheet = connected_components(links, directed=False)[1][self.corners[:, 0]]
        corners = self.rest[self.corners]
        self.watched = [k for k, row in enumerate(rows) if row[0] != PLANE and not self._holds(row, corners)]

    def first(self, rows: np.ndarray, x: np.ndarray) -> int | None:
        """The first obstacle that was outside all sheets at the start and is inside one now; x: unknowns [m]."""
        if not self.watched:
            return None
        corners = (self.rest + x[: self.rest.size].reshape(-1, 3))[self.corners]
        return next((k for k in self.watched if self._holds(rows[k], corners)), None)

    def _holds(self, row: np.ndarray, corners: np.ndarray) -> bool:
        """Whether a sheet with the triangles `corners` (nf, 3, 3) surrounds the middle of a sphere, or a point of a
        capsule's axis; these are no farther apart than its radius."""
        count = 2 + int(np.linalg.norm(row[4:7]) / row[7]) if row[0] == CAPSULE else 1
        return any(self._surrounded(row[1:4] + s * row[4:7], corners) for s in np.linspace(0.0, 1.0, count))

    def _surrounded(self, point: np.ndarray, corners: np.ndarray) -> bool:
        """By solid angles (Van Oosterom and Strackee 1983, doi:10.1109/TBME.1983.325207)."""
        a, b, c = (corners - point).transpose(1, 0, 2)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        volume = np.einsum("fi,fi->f", a, np.cross(b, c))
        dots = [np.einsum("fi,fi->f", v, w) * length for v, w, length in ((a, b, lc), (a, c, lb), (b, c, la))]
        angles = 2.0 * np.arctan2(volume, la * lb * lc + np.sum(dots, axis=0))
        return bool(np.any(np.abs(np.bincount(self.sheet, angles)) > 2.0 * np.pi))
