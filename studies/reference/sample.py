"""Samples: the quantities of one solution of a reference's family that are compared with the others."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from reference_fem import Equilibrium, Evaluator, Problem, nodes
from studies.geometry.mesh.organ_mesh import boundary_triangles, tetrahedron_volumes, triangle_areas
from studies.reference.problem import whole_forces
from studies.reference.ringing import ringing_frequency
from studies.scene.quantities import allowed
from studies.scene.scene import Scene
from studies.store.record import Record

SERIES = ("force", "volume", "pressure", "lumen_pressure")
"""Numbers of a sample at every checkpoint; NaN where it was not solved."""

NO_PAIRS = np.empty((0, 2), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class SamplePoints:
    """The points at which solutions are compared: the vertices of the coarsest mesh, with their shares of its rest
    volume and surface."""

    points: np.ndarray
    """[m], (b, 3)."""
    tetrahedra: np.ndarray
    """Tetrahedra of the coarsest mesh, (d, 4)."""
    symmetric: bool = False
    """Whether the mesh is an octant, whose planes of symmetry do not belong to the surface."""

    @cached_property
    def triangles(self) -> np.ndarray:
        """Triangles of the surface, (s, 3)."""
        triangles = boundary_triangles(self.tetrahedra)
        if not self.symmetric:
            return triangles
        return triangles[~np.any(np.all(np.abs(self.points[triangles]) < 1e-12, axis=1), axis=1)]

    @cached_property
    def size(self) -> float:
        """Diagonal of the whole body [m]."""
        return (2.0 if self.symmetric else 1.0) * float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @cached_property
    def volumes(self) -> np.ndarray:
        """Share of each vertex in the rest volume [m³], (b,)."""
        return _shares(self.tetrahedra, tetrahedron_volumes(self.points, self.tetrahedra), len(self.points))

    @cached_property
    def areas(self) -> np.ndarray:
        """Share of each vertex in the surface area [m²], (b,)."""
        return _shares(self.triangles, triangle_areas(self.points, self.triangles), len(self.points))


def _shares(corners: np.ndarray, sizes: np.ndarray, count: int) -> np.ndarray:
    """Share of each vertex in the sizes (k,) of elements with `corners` (k, c), (count,)."""
    width = corners.shape[1]
    return np.bincount(corners.ravel(), np.repeat(sizes / width, width), count)


@dataclass(frozen=True, eq=False)
class Sample:
    """One solution at the sample points."""

    variant: str
    """Name of the refined setting; "" for a mesh of the family."""
    unknowns: int
    size: float
    """Mean edge of the elements [m]; the error of meshes set by hand is a power of it."""
    u: np.ndarray
    """Displacement at the last checkpoint [m], (b, 3)."""
    force: np.ndarray
    """The probed force [N], (K,)."""
    volume: np.ndarray
    """Volume over rest volume [1], (K,)."""
    pressure: np.ndarray
    """Mean pressure over the volume, compression positive [Pa], (K,)."""
    lumen_pressure: np.ndarray
    """Pressure in the lumen [Pa], (K,)."""
    frequency: float = float("nan")
    """Frequency of the vibration [Hz]; NaN for a scene without one."""
    opening: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    """Displacement in front of a cut less that behind it at the last checkpoint [m], at its sample points, (y, 3)."""


def sample_of(
    scene: Scene, problem: Problem, equilibria: Sequence[Equilibrium], at: SamplePoints, size: float, variant: str = ""
) -> Sample:
    """The sample of equilibria, the last ones of the scene's checkpoints or all of them."""
    series = {name: np.full(len(scene.checkpoints), np.nan) for name in SERIES}
    if allowed(scene, "force"):
        forces = whole_forces(scene, np.array([e.obstacle_force for e in equilibria]))
        series["force"][-len(equilibria) :] = scene.output_force(forces, np.array([e.held_force for e in equilibria]))
    series["volume"][-len(equilibria) :] = [e.volume / e.volume0 for e in equilibria]
    series["pressure"][-len(equilibria) :] = [mean_pressure(problem, e) for e in equilibria]
    if scene.filled:
        series["lumen_pressure"][-len(equilibria) :] = [float(e.cavity_pressure.sum()) for e in equilibria]
    # Vertices come first in all meshes of a family. A point on a cut has two nodes, which only their numbers
    # distinguish.
    if scene.cuts or np.array_equal(nodes(problem.mesh)[: len(at.points)], at.points):
        moved = np.array([e.u[: len(at.points)] for e in equilibria])
    else:
        columns = np.concatenate([e.u for e in equilibria], axis=1)  # one field of 3 k components
        moved = Evaluator(problem.mesh).displacement(columns, at.points)
        moved = moved.reshape(len(at.points), len(equilibria), 3).transpose(1, 0, 2)
    frequency = float("nan")
    if allowed(scene, "frequency") and len(equilibria) == len(scene.checkpoints):
        frequency = ringing_frequency(scene, np.array(scene.checkpoints), at.points, moved, at.areas)
    unknowns = 3 * len(nodes(problem.mesh)) + problem.mesh.nvertices
    behind, front = parted(problem.mesh.p.T, len(at.points)).T if scene.cuts else NO_PAIRS.T
    opening = equilibria[-1].u[front] - equilibria[-1].u[behind]
    return Sample(variant, unknowns, size, moved[-1], **series, frequency=frequency, opening=opening)


def parted(points: np.ndarray, count: int) -> np.ndarray:
    """Pairs of the vertices at `points` (v, 3) that lie at one place, the first of them among `count`, (y, 2)."""
    order = np.lexsort((np.arange(len(points)), *points.T))
    same = (points[order][1:] == points[order][:-1]).all(axis=1)
    pairs = np.column_stack([order[:-1][same], order[1:][same]])
    return pairs[pairs[:, 0] < count][np.argsort(pairs[pairs[:, 0] < count, 0])]


def mean_pressure(problem: Problem, equilibrium: Equilibrium) -> float:
    """Volume mean of −p [Pa]: p of the solver is positive in tension, the multiplier of the springs in compression."""
    volume, tetrahedra = equilibrium.weights.sum(axis=1), problem.mesh.t[:4].T
    return -float(volume @ equilibrium.p[tetrahedra].mean(axis=1) / volume.sum())


def sample_fields(at: SamplePoints, samples: Sequence[Sample], checkpoints: int) -> dict[str, np.ndarray]:
    """Samples, fine to coarse and then the variants, as the fields of a record."""
    count = len(samples)
    shape = count, checkpoints
    each = {f"sample_{name}": np.array([getattr(one, name) for one in samples]).reshape(shape) for name in SERIES}
    opened = (
        {"sample_opening": np.array([one.opening for one in samples])} if samples and len(samples[0].opening) else {}
    )
    return (
        each
        | opened
        | {
            "sample_variant": np.array([one.variant for one in samples], dtype=str),
            "sample_unknowns": np.array([one.unknowns for one in samples], dtype=np.int64),
            "sample_size": np.array([one.size for one in samples], dtype=float),
            "sample_frequency": np.array([one.frequency for one in samples], dtype=float),
            "sample_displacement": np.array([one.u for one in samples]).reshape(count, len(at.points), 3),
            "sample_points": at.points,
            "sample_tetrahedra": at.tetrahedra,
        }
    )


def samples_in(scene: Scene, record: Record) -> tuple[SamplePoints, list[Sample]]:
    """(sample points, samples) from the fields that `sample_fields` stored."""
    get = lambda name: record.fields[f"sample_{name}"].values  # noqa: E731
    at = SamplePoints(get("points"), get("tetrahedra"), scene.symmetric)
    return at, [
        Sample(
            str(variant),
            int(get("unknowns")[k]),
            float(get("size")[k]),
            get("displacement")[k],
            **{name: get(name)[k] for name in SERIES},
            frequency=float(get("frequency")[k]),
            opening=get("opening")[k] if "sample_opening" in record.fields else np.empty((0, 3)),
        )
        for k, variant in enumerate(get("variant"))
    ]
