"""How far each quantity of a reference may be from the truth: shares of the mesh, load steps, contact and kappa.

Differences of solutions are taken at the vertices of the coarsest mesh, weighted with their rest volume or area.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from reference_fem.uncertainty import (
    BELIEVED,
    MeshError,
    Range,
    combined,
    field_error,
    mesh_error,
    orders_at_outlines,
    setting_error,
)
from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import boundary_triangles, tetrahedron_volumes, triangle_areas
from studies.geometry.surface.distance import hausdorff
from studies.reference.ringing import ringing_frequency
from studies.reference.solve import VARIANTS
from studies.scene.quantities import allowed

if TYPE_CHECKING:
    from studies.reference.solution import Solution

FAMILY = 3
"""Meshes that make an error bar, the finest ones; two make a large one."""


@dataclass(frozen=True)
class Uncertainty:
    """Of one quantity, relative to its size [1]."""

    shares: dict[str, float]
    """"mesh" and the names of VARIANTS."""
    order: float
    """Observed order of convergence in the element size; NaN where it is not monotone: the spread then counts."""
    shift: float
    """How far the extrapolated value is from that of the finest mesh, which is the one compared with."""

    @property
    def total(self) -> float:
        """The one number: root of the sum of the squares of the shares (docs, eq. 6.3)."""
        return combined(self.shares)


class SamplePoints:
    """Where solutions are compared: the vertices of a mesh, with their share of its rest volume and of its surface."""

    def __init__(self, solution: "Solution") -> None:
        cells = solution.field("tetrahedra")
        self.points = solution.field("nodes")[: int(cells.max()) + 1]
        self.triangles = solution.outside(boundary_triangles(cells))
        self.size = solution.size
        self.volumes = _shares(cells, tetrahedron_volumes(self.points, cells), len(self.points))
        self.areas = _shares(self.triangles, triangle_areas(self.points, self.triangles), len(self.points))


def _shares(corners: np.ndarray, sizes: np.ndarray, count: int) -> np.ndarray:
    """What each vertex has of the sizes (k,) of elements with `corners` (k, c), (count,)."""
    width = corners.shape[1]
    return np.bincount(corners.ravel(), np.repeat(sizes / width, width), count)


@dataclass(frozen=True, eq=False)
class Sample:
    """One solution at the sample points."""

    solution: "Solution"
    at: SamplePoints

    @cached_property
    def u(self) -> np.ndarray:
        """Displacement at the last checkpoint [m], (m, 3)."""
        return self.solution.displacement(self.at.points)

    @cached_property
    def frequency(self) -> float:
        """Of the ringing [Hz]; NaN for a scene that does not start with a speed."""
        scene, points = self.solution.scene, self.at.points
        moved = self.solution.displacements(points)
        return ringing_frequency(scene, np.array(scene.checkpoints), points, moved, self.at.areas)

    @property
    def force(self) -> np.ndarray:
        """The probed force at the checkpoints [N], (K,)."""
        return self.solution.force

    @property
    def element_size(self) -> float:
        """Of the mesh before elements were halved [m]. Raises StudyError for a record of older code."""
        return self._told("size", "its element size")

    @property
    def outline_size(self) -> float:
        """Of the elements at the outlines of held regions [m], NaN without one. Raises StudyError likewise."""
        return self._told("outline_size", "the size of its elements at outlines")

    def _told(self, name: str, words: str) -> float:
        known = self.solution.record.attributes
        if name not in known:
            raise StudyError(f"the reference {self.solution.record.name} does not record {words}; solve it again")
        return float(known[name])

    def series(self, name: str) -> np.ndarray:
        """A stored series of numbers, (K,)."""
        return self.solution.field(name)


Measure = Callable[[Sample, Sample], float]
"""Change from the first sample to the second, relative to the size of the quantity in the second."""


def force(a: Sample, b: Sample) -> float:
    """‖F_a − F_b‖/‖F_b‖ over the checkpoints."""
    return float(np.linalg.norm(a.force - b.force) / np.linalg.norm(b.force))


def force_end(a: Sample, b: Sample) -> float:
    """|F_a/F_b − 1| at the last checkpoint."""
    return float(abs(a.force[-1] / b.force[-1] - 1))


def _relative(a: Sample, b: Sample, weights: np.ndarray) -> float:
    change, size = ((a.u - b.u) ** 2).sum(axis=1), (b.u**2).sum(axis=1)
    return float(np.sqrt((weights @ change) / (weights @ size)))


def surface(a: Sample, b: Sample) -> float:
    """Area-weighted relative L2 of the displacement of the surface."""
    return _relative(a, b, b.at.areas)


def interior(a: Sample, b: Sample) -> float:
    """Volume-weighted relative L2 of the displacement."""
    return _relative(a, b, b.at.volumes)


def surface_mean(a: Sample, b: Sample) -> float:
    """Area-weighted mean of |u_a − u_b| over the largest |u_b|."""
    weights = b.at.areas
    mean = weights @ np.linalg.norm(a.u - b.u, axis=1) / weights.sum()
    return float(mean / np.linalg.norm(b.u[weights > 0], axis=1).max())


def silhouette(a: Sample, b: Sample) -> float:
    """Hausdorff distance of the surface moved by one and by the other, over the body's size."""
    points, triangles = b.at.points, b.at.triangles
    return hausdorff(points + a.u, triangles, points + b.u, triangles) / b.at.size


def volume(a: Sample, b: Sample) -> float:
    """Largest change of V/V0 over the checkpoints."""
    return float(np.abs(a.series("volume") - b.series("volume")).max())


def pressure(a: Sample, b: Sample) -> float:
    """|p_a/p_b − 1| at the last checkpoint."""
    return float(abs(a.series("pressure")[-1] / b.series("pressure")[-1] - 1))


def frequency(a: Sample, b: Sample) -> float:
    """|f_a/f_b − 1| of the ringing."""
    return abs(a.frequency / b.frequency - 1)


def lumen(a: Sample, b: Sample) -> float:
    """|p_a/p_b − 1| of the lumen at the last checkpoint."""
    return float(abs(a.series("lumen_pressure")[-1] / b.series("lumen_pressure")[-1] - 1))


NUMBERS: dict[str, tuple[Measure, Callable[[Sample], np.ndarray]]] = {
    "force": (force, lambda sample: sample.force),
    "force_end": (force_end, lambda sample: sample.force[-1:]),
    "volume": (volume, lambda sample: sample.series("volume")),
    "pressure": (pressure, lambda sample: sample.series("pressure")[-1:]),
    "frequency": (frequency, lambda sample: np.array([sample.frequency])),
    "lumen": (lumen, lambda sample: sample.series("lumen_pressure")[-1:]),
}
"""Numbers and series of them: how a change is measured, and the values."""
FIELDS: dict[str, tuple[Measure, Callable[[SamplePoints], np.ndarray]]] = {
    "surface": (surface, lambda at: at.areas),
    "interior": (interior, lambda at: at.volumes),
}
"""The displacement, with the weights of its points."""
ABOUT_SURFACE: dict[str, Measure] = {"surface_mean": surface_mean, "silhouette": silhouette}
"""What is read off the displaced surface: it has the bar of its change from one mesh to the next, times how many times
the change of the surface its own bar is."""
QUANTITIES: dict[str, Measure] = {name: m for name, (m, _) in (NUMBERS | FIELDS).items()} | ABOUT_SURFACE
"""By the name that metrics use."""


def uncertainties(
    finest: "Solution", coarser: Sequence["Solution"], sensitivity_runs: Sequence["Solution"]
) -> dict[str, Uncertainty]:
    """Uncertainty of every quantity of `finest` from the next coarser meshes (fine to coarse) and the sensitivity_runs.

    Raises StudyError without a coarser mesh.
    """
    if not coarser:
        raise StudyError(f"the reference of '{finest.scene.name}' has one mesh only, so no error bar; solve three")
    at = SamplePoints(coarser[-1])
    samples = [Sample(solution, at) for solution in (finest, *coarser)]
    better = {str(s.record.attributes["variant"]): Sample(s, at) for s in sensitivity_runs}
    family = samples[:FAMILY]
    found = {}
    for name, measure in QUANTITIES.items():
        if not allowed(finest.scene, name):
            continue
        mesh = _of_mesh(name, family)
        shares = {key: setting_error(measure(samples[-1], sample), VARIANTS[key][1]) for key, sample in better.items()}
        found[name] = Uncertainty({"mesh": mesh.uncertainty, **shares}, mesh.order, mesh.shift)
    return found


def _of_mesh(name: str, family: Sequence[Sample]) -> MeshError:
    """What the meshes leave, relative to the size of the quantity; the order is that in the element size."""
    sizes, believed, per_size = judged_by(family)
    if name in NUMBERS:
        values = [NUMBERS[name][1](sample) for sample in family]
        size = 1.0 if name == "volume" else float(np.linalg.norm(values[0]))
        error, sign = mesh_error(sizes, values, believed), float(np.sign(values[0][0]))
        return MeshError(error.uncertainty / size, sign * error.shift / size, per_size * error.order)
    weights = FIELDS[name if name in FIELDS else "surface"][1](family[0].at)
    field = field_error(sizes, [sample.u for sample in family], weights, believed)
    change = np.sqrt(weights @ ((family[1].u - family[0].u) ** 2).sum(axis=1))
    scale = QUANTITIES[name](family[1], family[0]) / change if change else 0.0
    return MeshError(scale * field.uncertainty, scale * field.shift, per_size * field.order)


def judged_by(family: Sequence[Sample]) -> tuple[list[float], Range, float]:
    """The sizes [m] of meshes, fine to coarse, that their errors are powers of; the orders in them that are believed;
    and such an order in the element size for one in these sizes, of the finer two.

    Where a region is held, those of the elements at its outline, where the slowest error comes from: what converges
    fast shows first in an order, and the singularity is left (docs, section 6).
    """
    scene, sizes = family[0].solution.scene, [sample.element_size for sample in family]
    if not scene.held or scene.symmetric:
        return sizes, BELIEVED, 1.0
    outlines = [sample.outline_size for sample in family]
    per_size = np.log(outlines[1] / outlines[0]) / np.log(sizes[1] / sizes[0])
    return outlines, orders_at_outlines(sizes, outlines), float(per_size)
