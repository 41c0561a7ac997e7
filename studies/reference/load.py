"""Loads the finite-element reference of a scene: its finest solution and its error bar."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from studies.base.errors import StudyError
from studies.reference.published import published, record_of
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.sample import Sample, SamplePoints, samples_in
from studies.reference.solution import Solution
from studies.reference.uncertainty import QUANTITIES, Uncertainty, uncertainties
from studies.scene.scene import Scene
from studies.store.record import Status, read_record


@dataclass(frozen=True, eq=False)
class Reference(Solution):
    """The solution on the finest mesh, with its uncertainty from the other meshes and settings."""

    @property
    def source(self) -> str:
        """The published set and file, as "2027.1 0a1b2c3d"; "solved here" for a reference that is not published."""
        return str(self.record.attributes.get("set", "solved here"))

    @property
    def shape_error(self) -> float:
        """Largest distance of the finest mesh from the true shape, over the size [1]; NaN if it was not measured."""
        return float(self.record.attributes.get("shape_error", np.nan))

    @property
    def warnings(self) -> str:
        """That the finest mesh is far from the true shape; else empty."""
        return str(self.record.attributes.get("warnings", ""))

    @cached_property
    def _samples(self) -> tuple[SamplePoints, list[Sample]]:
        return samples_in(self.scene, self.record)

    @property
    def at(self) -> SamplePoints:
        """The points at which solutions are compared."""
        return self._samples[0]

    @property
    def meshes(self) -> list[Sample]:
        """Samples of the meshes of the family, fine to coarse."""
        return [one for one in self._samples[1] if not one.variant]

    @property
    def variants(self) -> dict[str, Sample]:
        """Samples of the coarsest mesh with one refined setting each."""
        return {one.variant: one for one in self._samples[1] if one.variant}

    @cached_property
    def uncertainty(self) -> dict[str, Uncertainty]:
        """Uncertainty of each quantity by shares."""
        least_j = float(np.nanmin(self.field("min_j")))
        return uncertainties(self.scene, self.at, self.meshes, self.variants, least_j)

    @cached_property
    def total_uncertainty(self) -> dict[str, float]:
        """Uncertainty of each quantity [1], relative to its size (docs, eq. 6.3)."""
        return {name: of_quantity.total for name, of_quantity in self.uncertainty.items()}

    def apart(self, other: "Reference") -> dict[str, tuple[float, float]]:
        """How far this reference is from another of the scene: quantity -> (difference, sum of both error bars), both
        relative to the size of the quantity [1], at the sample points of this one."""
        here, there = self._at(self.at), other._at(self.at)
        return {
            name: (QUANTITIES[name](self.at, here, there), bar + other.total_uncertainty[name])
            for name, bar in self.total_uncertainty.items()
        }

    def _at(self, at: SamplePoints) -> Sample:
        """The finest mesh, sampled at points of any reference of the scene."""
        finest = self.meshes[0]
        series = {name: self.field(name) for name in ("volume", "pressure", "lumen_pressure")}
        u = self.displacement(at.points)
        return Sample("", finest.unknowns, finest.size, u, self.force, **series, frequency=finest.frequency)


def load_reference(root: Path, scene: Scene) -> Reference | None:
    """The stored reference of a scene; None for a scene without a plan.

    Raises StudyError when it is missing, or did not converge.
    """
    if scene.reference is None:
        return None
    record = read_record(ReferenceSolve(scene).path(root))
    if record.status != Status.OK:
        raise StudyError(f"the reference of '{scene.name}' is {record.status}: {record.message}")
    return Reference(scene, record)


def reference_for(root: Path, scene: Scene) -> Reference | None:
    """The reference of a scene: the published one, else the one stored below `root`; None for a scene without a plan.

    Raises StudyError as load_reference.
    """
    entry = published(scene)
    return load_reference(root, scene) if entry is None else Reference(scene, record_of(scene, entry))
