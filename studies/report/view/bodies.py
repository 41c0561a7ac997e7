"""What is shown: bodies at the checkpoints of a scene, made of the records of a run and of a reference."""

from dataclasses import dataclass
from itertools import product

import numpy as np

from reference_fem.elements.shapes import element_nodes
from studies.metrics.run import Run
from studies.reference.solution import Solution
from studies.scene.quantities import allowed
from studies.store.vtk_group import TETRAHEDRON, TRIANGLE

QUADRATIC_TETRAHEDRON = 24
"""As VTK numbers this type of cells (vtkCellType.h)."""
TURNED = [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]
"""Nodes of a quadratic tetrahedron after the exchange of its second and third vertex."""
COMPARED = "surface"
"""Quantity that a scene must allow where displacements are to be compared: a body that may turn or slip has none."""


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


def shown_run(run: Run, solution: Solution | None, name: str) -> Shown:
    """A stored run; its errors where there is a reference and the scene lets displacements be compared."""
    rest, frames = run.fields.rest, run.checkpoint_frames
    displacement = np.full((len(frames), *rest.shape), np.nan)
    reached = run.fields.snapshots
    displacement[: len(reached)] = reached - rest
    cells = run.fields.tetrahedra if len(run.fields.tetrahedra) else run.fields.triangles
    return Shown(
        name=name,
        rest=rest,
        displacement=displacement,
        error=_error(run, solution, displacement),
        cells=cells.astype(np.int64),
        volume_ratio=run.volume_ratio[frames],
        force=run.force[frames],
    )


def _error(run: Run, solution: Solution | None, displacement: np.ndarray) -> np.ndarray | None:
    if solution is None or not allowed(run.case.scene, COMPARED):
        return None
    error = np.full_like(displacement, np.nan)
    nodes = run.material_nodes
    error[:, nodes] = displacement[:, nodes] - solution.displacements(run.places[nodes])
    return error


def shown_reference(solution: Solution, name: str) -> Shown:
    """The whole body of a reference, an octant mirrored. Its error is zero: the others are measured from it."""
    signs = np.array(list(product((1.0, -1.0), repeat=3))) if solution.scene.symmetric else np.ones((1, 3))
    nodes, cells = solution.field("nodes"), element_nodes(solution.mesh)
    rest = (signs[:, None] * nodes).reshape(-1, 3)
    moved = solution.field("displacement")
    displacement = (signs[:, None] * moved[:, None]).reshape(len(moved), -1, 3)
    every = (cells + len(nodes) * np.arange(len(signs))[:, None, None]).reshape(-1, cells.shape[1])
    return Shown(
        name=name,
        rest=rest,
        displacement=displacement,
        error=np.zeros_like(displacement) if allowed(solution.scene, COMPARED) else None,
        cells=upright(rest, every).astype(np.int64),
        volume_ratio=solution.field("volume"),
        force=solution.force,
    )
