"""The problem to be solved: a body, its material, its supports, its loads and obstacles."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from skfem import MeshTet

from reference_fem.elements.shapes import ORDER, facet_nodes, nodes
from reference_fem.errors import SolveError
from reference_fem.model.cavity import Cavity
from reference_fem.model.loads import BodyForce, PointMass, Traction
from reference_fem.model.material import Material
from reference_fem.model.obstacles import Obstacle, finite_vector


@dataclass(frozen=True, eq=False)
class PrescribedDisplacement:
    """Displacement components prescribed at boundary nodes.

    where: (3, N) rest positions -> bool (N,), evaluated at the nodes of the boundary.
    motion: t [s] -> (3,) displacement [m], None = fixed. shape: (3, N) rest positions -> (3, N) factors that the
    displacement is multiplied with, component by component, None = 1 (for radial or affine motions).
    """

    where: Callable
    components: Sequence[int] = (0, 1, 2)
    motion: Callable | None = None
    shape: Callable | None = None


@dataclass(frozen=True, eq=False)
class Problem:
    """A quasi-static problem in SI units; the body is stress-free on its mesh.

    mesh: MeshTet (straight) or MeshTet2 (curved, see curve). gravity [m/s²], density [kg/m³].
    cavities: lumens that keep a volume or a pressure; a lumen not named is open. order: degree integrated exactly, at
    least 4. loads: dead forces, applied with gravity at the start, then functions of time.
    masses: point masses at nodes. faces_touch: boundary facets that coincide at rest, those of a cut, may not overlap;
    they slide without friction, by less than a facet.
    """

    mesh: MeshTet
    material: Material
    held: Sequence[PrescribedDisplacement]
    obstacles: Sequence[Obstacle] = ()
    gravity: Sequence[float] = (0.0, 0.0, 0.0)
    density: float = 0.0
    order: int = ORDER
    contact_order: int = 4
    cavities: Sequence[Cavity] = ()
    loads: Sequence[Traction | BodyForce] = ()
    masses: Sequence[PointMass] = ()
    faces_touch: bool = False


@dataclass(frozen=True, eq=False)
class HeldNodes:
    """One PrescribedDisplacement on one mesh: its nodes, its unknowns, and the displacement factors."""

    nodes: np.ndarray
    dofs: np.ndarray
    """Unknowns, component by component, (k, len(nodes))."""
    components: tuple
    factors: np.ndarray
    """(k, len(nodes))."""
    motion: Callable | None = field(default=None)

    def displacement(self, t: float):
        """Prescribed displacement of `dofs` at time t [m]."""
        if self.motion is None:
            return np.zeros_like(self.factors)
        moved = finite_vector(self.motion(t), f"the motion of a held region at t = {t:g} s")
        return moved[list(self.components), None] * self.factors


def find_held(problem: Problem) -> list[HeldNodes]:
    """Held regions as unknowns; raises SolveError if a region contains no node or names a wrong component."""
    x, boundary = nodes(problem.mesh), np.unique(facet_nodes(problem.mesh))
    regions = []
    for k, held in enumerate(problem.held):
        components = tuple(held.components)
        if not components or not set(components) <= {0, 1, 2}:
            raise SolveError(f"held region {k} names components {components}: give some of 0, 1, 2")
        chosen = boundary[np.asarray(held.where(x[boundary].T), dtype=bool)]
        if chosen.size == 0:
            low, high = x.min(axis=0), x.max(axis=0)
            raise SolveError(
                f"held region {k} contains no boundary node: the body fills {np.array2string(low, precision=4)} to "
                f"{np.array2string(high, precision=4)} m, choose a region that touches its surface"
            )
        factors = np.ones((3, chosen.size)) if held.shape is None else np.asarray(held.shape(x[chosen].T), dtype=float)
        dofs = np.stack([3 * chosen + c for c in components])
        regions.append(HeldNodes(chosen, dofs, components, factors[list(components)], held.motion))
    return regions
