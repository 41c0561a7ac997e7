"""The finite-element reference of a scene, read back: its solutions and their error bar."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from studies.base.errors import StudyError
from studies.reference.reference_solves import ReferenceSolve, reference_solves
from studies.reference.solution import Solution
from studies.reference.uncertainty import Uncertainty, uncertainties
from studies.scene.scene import Scene
from studies.store.record import Record, Status, read_record


@dataclass(frozen=True, eq=False)
class Reference(Solution):
    """The solution on the finest mesh, with those that say how good it is."""

    coarser: tuple[Solution, ...] = ()
    """The other meshes of the family, fine to coarse."""
    sensitivity_runs: tuple[Solution, ...] = ()
    """The coarsest mesh with one setting made better each."""

    @cached_property
    def uncertainty(self) -> dict[str, Uncertainty]:
        """Of each quantity, share by share."""
        return uncertainties(self, self.coarser, self.sensitivity_runs)

    @cached_property
    def total_uncertainty(self) -> dict[str, float]:
        """Uncertainty of each quantity [1], relative to its size (docs, eq. 6.3)."""
        return {name: found.total for name, found in self.uncertainty.items()}


def load_reference(root: Path, scene: Scene) -> Reference | None:
    """The finest stored solution with its family and sensitivity runs behind it; None for a scene without a plan.

    Raises StudyError when one is missing, or did not converge.
    """
    if scene.reference is None:
        return None
    found = {
        (reference_solve.level, reference_solve.variant): _converged(root, reference_solve)
        for reference_solve in reference_solves(scene)
    }
    *coarser, finest = [record for (_, variant), record in found.items() if not variant]
    return Reference(
        scene,
        finest,
        tuple(Solution(scene, record) for record in reversed(coarser)),
        tuple(Solution(scene, record) for (_, variant), record in found.items() if variant),
    )


def _converged(root: Path, reference_solve: ReferenceSolve) -> Record:
    record = read_record(reference_solve.path(root))
    if record.status != Status.OK:
        what = f" with other {reference_solve.variant}" if reference_solve.variant else ""
        where = f"the reference of '{reference_solve.scene.name}' on mesh {reference_solve.level:g}{what}"
        raise StudyError(f"{where} is {record.status}: {record.message}")
    return record
