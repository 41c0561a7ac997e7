"""Uncertainty of each quantity of a reference: shares of the mesh, load steps, contact and kappa.

Differences of solutions are taken at the vertices of the coarsest mesh, weighted with their rest volume or area.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from reference_fem.uncertainty import MeshError, combined, field_error, mesh_error, nested_error, setting_error
from studies.base.errors import StudyError
from studies.geometry.surface.distance import hausdorff
from studies.reference.sample import Sample, SamplePoints
from studies.scene.quantities import allowed
from studies.scene.scene import Scene

FAMILY = 3
"""Number of the finest meshes used for an error bar; with two the bar is large."""
PENALTY_FACTOR, KAPPA_FACTOR, STEP_FACTOR = 3.0, 10.0, 2.0
"""Factors of the refined settings: contact stiffness and reciprocal penetration, bulk modulus, number of load steps."""
FACTORS = {"steps": STEP_FACTOR, "contact": PENALTY_FACTOR, "kappa": KAPPA_FACTOR}
"""Factor by the name of the setting."""
STRAINED, EDGE = 0.1, 0.002
"""Share EDGE for what the nested meshes of a body with a least J below STRAINED have in common: the smallest elements
at a held edge. The force of the clamped ball, least J 0.03, depends on them by 0.1 to 0.2 % (docs/theory.md, section
6)."""


@dataclass(frozen=True)
class Uncertainty:
    """Uncertainty of one quantity, relative to its size [1]."""

    shares: dict[str, float]
    """Shares by source: "mesh", "edge" and the names of FACTORS."""
    order: float
    """Observed order of convergence in the element size; NaN if convergence is not monotone (the spread is then used),
    and for nested meshes, whose rate is assumed."""
    shift: float
    """Extrapolated value minus that of the finest mesh, with which runs are compared; 0 for nested meshes."""

    @property
    def total(self) -> float:
        """The combined uncertainty: root of the sum of the squares of the shares (docs, eq. 6.3)."""
        return combined(self.shares)


Measure = Callable[[SamplePoints, Sample, Sample], float]
"""Change from the first sample to the second, relative to the size of the quantity in the second."""


def force(at: SamplePoints, a: Sample, b: Sample) -> float:
    """‖F_a − F_b‖/‖F_b‖ over the checkpoints that both have."""
    both = np.isfinite(a.force) & np.isfinite(b.force)
    return float(np.linalg.norm((a.force - b.force)[both]) / np.linalg.norm(b.force[both]))


def _relative(a: Sample, b: Sample, weights: np.ndarray) -> float:
    change, size = ((a.u - b.u) ** 2).sum(axis=1), (b.u**2).sum(axis=1)
    return float(np.sqrt((weights @ change) / (weights @ size)))


def surface(at: SamplePoints, a: Sample, b: Sample) -> float:
    """Area-weighted relative L2 of the displacement of the surface."""
    return _relative(a, b, at.areas)


def interior(at: SamplePoints, a: Sample, b: Sample) -> float:
    """Volume-weighted relative L2 of the displacement."""
    return _relative(a, b, at.volumes)


def surface_mean(at: SamplePoints, a: Sample, b: Sample) -> float:
    """Area-weighted mean of |u_a − u_b| over the largest |u_b|."""
    weights = at.areas
    mean = weights @ np.linalg.norm(a.u - b.u, axis=1) / weights.sum()
    return float(mean / np.linalg.norm(b.u[weights > 0], axis=1).max())


def silhouette(at: SamplePoints, a: Sample, b: Sample) -> float:
    """Hausdorff distance of the surface moved by one and by the other, over the body's size."""
    return hausdorff(at.points + a.u, at.triangles, at.points + b.u, at.triangles) / at.size


def volume(at: SamplePoints, a: Sample, b: Sample) -> float:
    """Largest change of V/V0 over the checkpoints that both have."""
    return float(np.nanmax(np.abs(a.volume - b.volume)))


def opening(at: SamplePoints, a: Sample, b: Sample) -> float:
    """Relative L2 of the displacement across a cut, over the vertices that it parts."""
    return float(np.linalg.norm(a.opening - b.opening) / np.linalg.norm(b.opening))


Values = Callable[[Sample], np.ndarray]


def end(values: Values) -> tuple[Measure, Values]:
    """|value_a/value_b − 1| of the last of some values, and those values."""
    return (lambda at, a, b: float(abs(values(a)[-1] / values(b)[-1] - 1))), values


NUMBERS: dict[str, tuple[Measure, Values]] = {
    "force": (force, lambda sample: sample.force),
    "force_end": end(lambda sample: sample.force[-1:]),
    "volume": (volume, lambda sample: sample.volume),
    "pressure": end(lambda sample: sample.pressure[-1:]),
    "frequency": end(lambda sample: np.array([sample.frequency])),
    "lumen": end(lambda sample: sample.lumen_pressure[-1:]),
}
"""Numbers and series: (measure of a change, values of a sample)."""
FIELDS: dict[str, tuple[Measure, Callable[[SamplePoints], np.ndarray]]] = {
    "surface": (surface, lambda at: at.areas),
    "interior": (interior, lambda at: at.volumes),
}
"""Displacement fields: (measure of a change, weights of the points)."""
ABOUT_SURFACE: dict[str, Measure] = {"surface_mean": surface_mean, "silhouette": silhouette, "opening": opening}
"""Quantities derived from the displaced surface. On meshes set by hand their error bar is their change between two
meshes times the ratio of bar to change of "surface"."""
QUANTITIES: dict[str, Measure] = {name: m for name, (m, _) in (NUMBERS | FIELDS).items()} | ABOUT_SURFACE
"""All measures by the name of the quantity in metrics."""


def uncertainties(
    scene: Scene, at: SamplePoints, meshes: Sequence[Sample], variants: Mapping[str, Sample], least_j: float
) -> dict[str, Uncertainty]:
    """Uncertainty of every quantity on the finest of the meshes (fine to coarse), and from the refined settings on the
    coarsest. least_j: the least J [1] on the finest mesh at any checkpoint. The volume has no share EDGE: elements of
    any size keep it.

    Raises StudyError without a coarser mesh.
    """
    if len(meshes) < 2:
        raise StudyError(f"the reference of '{scene.name}' has one mesh only, so no error bar; solve three")
    result = {}
    with np.errstate(divide="ignore", invalid="ignore"):
        for name, measure in QUANTITIES.items():
            if not allowed(scene, name):
                continue
            mesh = uncertainty_of_meshes(scene, at, meshes, name)
            shares = {key: setting_error(measure(at, meshes[-1], one), FACTORS[key]) for key, one in variants.items()}
            edge = {"edge": EDGE} if scene.held and least_j < STRAINED and name != "volume" else {}
            result[name] = Uncertainty({"mesh": mesh.uncertainty} | edge | shares, mesh.order, mesh.shift)
    return result


def uncertainty_of_meshes(scene: Scene, at: SamplePoints, meshes: Sequence[Sample], name: str) -> MeshError:
    """The share of the mesh in the uncertainty of quantity `name`, relative to its size; meshes: fine to coarse, two or
    more."""
    assert scene.reference is not None  # it was solved
    family = meshes[:FAMILY]
    finest = family[0]
    if name in NUMBERS and not NUMBERS[name][1](finest).any():  # a force that is 0: nothing is relative to it
        return MeshError(float("nan"), 0.0, float("nan"))
    if scene.reference.nested:
        changes = [QUANTITIES[name](at, other, finest) for other in family[1:]]
        return MeshError(nested_error([one.unknowns for one in family], changes), 0.0, float("nan"))
    sizes = [one.size for one in family]
    if name in NUMBERS:
        values = [NUMBERS[name][1](one) for one in family]
        size = 1.0 if name == "volume" else float(np.linalg.norm(values[0]))
        error, sign = mesh_error(sizes, values), float(np.sign(values[0][0]))
        return MeshError(error.uncertainty / size, sign * error.shift / size, error.order)
    weights = FIELDS[name if name in FIELDS else "surface"][1](at)
    field = field_error(sizes, [one.u for one in family], weights)
    change = np.sqrt(weights @ ((family[1].u - finest.u) ** 2).sum(axis=1))
    scale = QUANTITIES[name](at, family[1], finest) / change if change else 0.0
    return MeshError(scale * field.uncertainty, scale * field.shift, field.order)
