"""Bodies to show, made of the records of a run and of a reference."""

from itertools import product

import numpy as np

from reference_fem.elements.shapes import element_nodes
from studies.metrics.run import Run
from studies.reference.solution import Solution
from studies.report.view.body import Shown, upright
from studies.scene.quantities import allowed

COMPARED = "surface"
"""Quantity that a scene must allow where displacements are to be compared: a body that may turn or slip has none."""


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
