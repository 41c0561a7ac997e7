"""How far each quantity of a reference may be from the truth: shares of the mesh, load steps, contact and kappa.

Differences of solutions are taken at the vertices of the coarsest mesh, weighted with their rest volume or area, so
that a mesh refined somewhere does not count more there.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from reference_fem.uncertainty import alike, cell_size, changes_error, combined, setting_error
from studies.distance import hausdorff
from studies.errors import StudyError
from studies.geometry.mesh import boundary_triangles, tetrahedron_volumes, triangle_areas
from studies.reference_solve import VARIANTS

if TYPE_CHECKING:
    from studies.reference import Solution

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
        """The one number: root of the sum of the squares of the shares (docs, eq. 20)."""
        return combined(self.shares)


class Places:
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
class View:
    """One solution, seen at the places."""

    solution: "Solution"
    places: Places

    @cached_property
    def u(self) -> np.ndarray:
        """Displacement at the last checkpoint [m], (m, 3)."""
        return self.solution.displacement(self.places.points)

    @property
    def force(self) -> np.ndarray:
        """The probed force at the checkpoints [N], (K,)."""
        return self.solution.force

    @property
    def cell_size(self) -> float:
        """Representative size of an element [m]."""
        return cell_size(float(self.places.volumes.sum()), len(self.solution.field("tetrahedra")))

    def series(self, name: str) -> np.ndarray:
        """A stored series of numbers, (K,)."""
        return self.solution.field(name)


Measure = Callable[[View, View], float]
"""Change from the first view to the second, relative to the size of the quantity in the second."""


def force(a: View, b: View) -> float:
    """‖F_a − F_b‖/‖F_b‖ over the checkpoints."""
    return float(np.linalg.norm(a.force - b.force) / np.linalg.norm(b.force))


def force_end(a: View, b: View) -> float:
    """|F_a/F_b − 1| at the last checkpoint."""
    return float(abs(a.force[-1] / b.force[-1] - 1))


def _relative(a: View, b: View, weights: np.ndarray) -> float:
    change, size = ((a.u - b.u) ** 2).sum(axis=1), (b.u**2).sum(axis=1)
    return float(np.sqrt((weights @ change) / (weights @ size)))


def surface(a: View, b: View) -> float:
    """Area-weighted relative L2 of the displacement of the surface."""
    return _relative(a, b, b.places.areas)


def interior(a: View, b: View) -> float:
    """Volume-weighted relative L2 of the displacement."""
    return _relative(a, b, b.places.volumes)


def surface_mean(a: View, b: View) -> float:
    """Area-weighted mean of |u_a − u_b| over the largest |u_b|."""
    weights = b.places.areas
    mean = weights @ np.linalg.norm(a.u - b.u, axis=1) / weights.sum()
    return float(mean / np.linalg.norm(b.u[weights > 0], axis=1).max())


def silhouette(a: View, b: View) -> float:
    """Hausdorff distance of the surface moved by one and by the other, over the body's size."""
    points, triangles = b.places.points, b.places.triangles
    return hausdorff(points + a.u, triangles, points + b.u, triangles) / b.places.size


def volume(a: View, b: View) -> float:
    """Largest change of V/V0 over the checkpoints."""
    return float(np.abs(a.series("volume") - b.series("volume")).max())


def pressure(a: View, b: View) -> float:
    """|p_a/p_b − 1| at the last checkpoint."""
    return float(abs(a.series("pressure")[-1] / b.series("pressure")[-1] - 1))


def _inside(view: View) -> np.ndarray:
    return view.u * np.sqrt(view.places.volumes)[:, None]


def _outside(view: View) -> np.ndarray:
    return view.u * np.sqrt(view.places.areas)[:, None]


QUANTITIES: dict[str, tuple[Measure, Callable[[View], np.ndarray]]] = {
    "force": (force, lambda view: view.force),
    "force_end": (force_end, lambda view: view.force[-1:]),
    "surface": (surface, _outside),
    "surface_mean": (surface_mean, _outside),
    "interior": (interior, _inside),
    "silhouette": (silhouette, _outside),
    "volume": (volume, lambda view: view.series("volume")),
    "pressure": (pressure, lambda view: view.series("pressure")[-1:]),
}
"""By the name that metrics use: how a change is measured, and the vector whose changes tell whether they are alike."""


def uncertainties(
    finest: "Solution", coarser: Sequence["Solution"], variants: Sequence["Solution"]
) -> dict[str, Uncertainty]:
    """Uncertainty of every quantity of `finest` from the next coarser meshes (fine to coarse) and the variants.

    Raises StudyError without a coarser mesh.
    """
    if not coarser:
        raise StudyError(f"the reference of '{finest.scene.name}' has one mesh only, so no error bar; solve three")
    places = Places(coarser[-1])
    views = [View(solution, places) for solution in (finest, *coarser)]
    better = {str(s.record.attributes["variant"]): View(s, places) for s in variants}
    return {name: _uncertainty(name, views, better) for name in QUANTITIES}


def _uncertainty(name: str, views: Sequence[View], better: Mapping[str, View]) -> Uncertainty:
    measure, vector = QUANTITIES[name]
    family = views[:FAMILY]
    sizes = [view.cell_size for view in family]
    changes = [measure(b, a) for a, b in pairwise(family)]
    vectors = [vector(view) for view in family]
    same_way = True
    if len(family) == FAMILY:
        changes.append(measure(family[2], family[0]))
        same_way = alike(vectors[1] - vectors[0], vectors[2] - vectors[1])
    mesh = changes_error(sizes, changes, same_way)
    shares = {key: setting_error(measure(views[-1], view), VARIANTS[key][1]) for key, view in better.items()}
    return Uncertainty({"mesh": mesh.uncertainty, **shares}, mesh.order, _sign(vectors) * mesh.shift)


def _sign(vectors: Sequence[np.ndarray]) -> float:
    """Which way a number goes on from the finest mesh, as a change of its size; a field has no sign."""
    fine, middle = vectors[:2]
    return float(np.sign((fine - middle) * fine)[0]) if fine.size == 1 else 1.0
