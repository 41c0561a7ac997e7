"""What is shown: a body with its positions, errors and histories at the checkpoints of a scene."""

from dataclasses import dataclass

import numpy as np

from studies.store.vtk_group import TETRAHEDRON, TRIANGLE

QUADRATIC_TETRAHEDRON = 24
"""As VTK numbers this type of cells (vtkCellType.h)."""
TURNED = [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]
"""Nodes of a quadratic tetrahedron after the exchange of its second and third vertex."""


@dataclass(frozen=True, eq=False)
class Shown:
    """A body at K checkpoints; NaN at those that it did not reach."""

    name: str
    rest: np.ndarray
    """Rest positions [m], (n, 3)."""
    displacement: np.ndarray
    """[m], (K, n, 3)."""
    error: np.ndarray | None
    """Displacement minus that of the reference [m], (K, n, 3), NaN at nodes that are no points of the organ; None
    without a reference that it may be compared with."""
    cells: np.ndarray
    """Nodes of each cell, (c, 3), (c, 4) or (c, 10)."""
    volume_ratio: np.ndarray
    """V/V0 [1], (K,)."""
    force: np.ndarray
    """The probed force [N], (K,)."""

    @property
    def cell_type(self) -> int:
        return {3: TRIANGLE, 4: TETRAHEDRON, 10: QUADRATIC_TETRAHEDRON}[self.cells.shape[1]]

    @property
    def positions(self) -> np.ndarray:
        """[m], (K, n, 3). A body that ended early stays where it was last; its displacement there is NaN."""
        positions, last = np.empty_like(self.displacement), self.rest
        for k, frame in enumerate(self.rest + self.displacement):
            last = positions[k] = frame if np.isfinite(frame).all() else last
        return positions


def upright(rest: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Quadratic tetrahedra (c, 10), those of negative volume turned; rest: (n, 3) [m]."""
    a, b, c, d = (rest[cells[:, k]] for k in range(4))
    wrong = np.einsum("ni,ni->n", np.cross(b - a, c - a), d - a) < 0
    turned = cells.copy()
    turned[wrong] = cells[wrong][:, TURNED]
    return turned
