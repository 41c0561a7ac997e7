"""A body: particles, springs, its closed surface and the volumes that can be kept."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from massspring.body.points import PointVolumes
from massspring.body.springs import Springs, lengths
from massspring.body.surface import check_finite, check_surface
from massspring.body.volumes import Volumes, tetrahedron_volumes
from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import Membrane
from massspring.kernels.forces.springs import spring_energy, spring_forces_into
from massspring.kernels.forces.volume import enclosed_volume, smallest_ratio, volume_gradient_into

SAME_VOLUME = 1e-9
"""Relative difference below which two volumes are equal: both are sums of the same determinants and differ by round-off
of some million additions."""
BALANCED = 1e-8
"""Net force at rest allowed at a node, over the largest force of a node: far above round-off, far below the force of
one surplus spring."""
NO_MEMBRANE = Membrane(np.empty((0, 3), dtype=np.uint32), *(np.empty((0, 3)) for _ in range(3)))
NO_TETRAHEDRA = np.empty((0, 4), dtype=np.uint32)
NO_FACETS = np.empty((0, 6), dtype=np.uint32)


def check_positive(volumes: np.ndarray) -> None:
    """Raises MassSpringError naming the worst of tetrahedra that are flat or inside-out; `volumes` (k,) [m³]."""
    if len(volumes) and not (volumes > 0).all():
        worst = int(np.argmin(volumes))
        raise MassSpringError(
            f"tetrahedron {worst} has volume {volumes[worst]:.3g} m³; swap two of its nodes or remove it"
        )


@dataclass(frozen=True, eq=False)
class Material:
    """Isotropic tissue."""

    shear_modulus: float
    """mu [Pa]."""
    density: float
    """rho [kg/m³]."""

    def __post_init__(self) -> None:
        for name, unit in (("shear_modulus", "Pa"), ("density", "kg/m³")):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise MassSpringError(f"{name} is {value} {unit}; it must be a positive finite number")


class Measured(NamedTuple):
    """A shape of a body, and what it does to volumes and elements."""

    x: np.ndarray
    """Positions [m], (n, 3)."""
    volume: np.ndarray
    """V_r [m³], (m,)."""
    least_j: float
    """Smallest J [1]: of quadratic elements det F at their points (eq. 8.8), as in a reference, of linear ones
    V_t / V_t0 (eq. 2.3); NaN without elements, or where one is not a number."""
    local_energy: float
    """½ b Σ_q w_q (J_q − 1)² [J]; 0 for a body without `local_bulk`."""


@dataclass(frozen=True, eq=False)
class Body:
    """n nodes at rest; the solver never changes it."""

    rest: np.ndarray
    """Rest positions [m], (n, 3)."""
    mass: np.ndarray
    """[kg], (n,)."""
    springs: Springs
    triangles: np.ndarray
    """Closed surface, outward, (f, 3) uint32; of several sheets for a hollow body (inner sheets face the lumen)."""
    tetrahedra: np.ndarray = field(default_factory=lambda: NO_TETRAHEDRA)
    """(k, 4) uint32, positive; empty for a surface body."""
    law: str = "given"
    """Stiffness law, recorded with every result: it alone moves a force by 12–16 %."""
    volumes: Volumes | PointVolumes | None = None
    """The volumes that methods keep; None: the whole volume."""
    rest_pressure: float = 0.0
    """Pressure that balances springs without length at rest [Pa]; 0 for springs that rest at their own length."""
    membrane: Membrane = NO_MEMBRANE
    """Triangle springs of a wall."""
    local_bulk: float = 0.0
    """b [Pa]: a pressure −b (J_q − 1) at the points of `PointVolumes`, added to that of the volumes."""
    contact_facets: np.ndarray = field(default_factory=lambda: NO_FACETS)
    """Quadratic facets at whose points round obstacles touch a body of `PointVolumes`, (f, 6). If empty, all obstacles
    touch nodes."""
    inertia: np.ndarray | None = None
    """Inertial mass of the nodes [kg], (n,), if it differs from `mass`; gravity always acts on `mass`."""
    share: np.ndarray | None = None
    """Part of each tetrahedron that is tissue [1], (k,), where copies of cells share it (`virtual_nodes`); `triangles`
    are then the surface before the cut, on the nodes that were there. None: all of each."""

    def __post_init__(self) -> None:
        check_finite("rest positions", self.rest)
        check_finite("masses", self.mass)
        check_surface(self.rest, self.triangles)
        if len(self.mass) != len(self.rest):
            raise MassSpringError(f"{len(self.mass)} masses for {len(self.rest)} nodes; give one mass per node")
        if not (self.mass > 0).all():
            node = int(np.argmin(self.mass))
            raise MassSpringError(f"node {node} has mass {self.mass[node]:g} kg; every node needs a positive mass")
        if self.inertia is not None and not (len(self.inertia) == len(self.rest) and (self.inertia > 0).all()):
            raise MassSpringError("the inertia is not positive at every node; give one positive mass per node, or none")
        self._check_springs()
        check_positive(self.tetrahedron_volumes)
        self._check_volumes()

    def _check_volumes(self) -> None:
        filled = float(self.tissue_volumes.sum())
        if len(self.tetrahedra) and abs(filled - self.volume) > SAME_VOLUME * filled:
            raise MassSpringError(
                f"the surface encloses {self.volume:.6g} m³ but the tetrahedra fill {filled:.6g} m³; "
                "give all sheets of their boundary, each turned outward of the tissue"
            )
        if self.kept.highest_node >= len(self.rest):
            raise MassSpringError(
                f"a kept volume names a node beyond the {len(self.rest)} there are; build it on this body"
            )
        if not (self.rest_volumes > 0).all():
            worst = int(np.argmin(self.rest_volumes))
            name, volume = self.kept.names[worst], self.rest_volumes[worst]
            raise MassSpringError(f"volume '{name}' is {volume:.3g} m³ at rest; flip its triangles")

    def _check_springs(self) -> None:
        springs = self.springs
        for what, nodes in (("spring ends at", springs.ends), ("triangle spring names", self.membrane.triangles)):
            last = int(nodes.max(initial=0))
            if last >= len(self.rest):
                raise MassSpringError(f"a {what} node {last}, but there are {len(self.rest)} nodes")
        check_finite("spring stiffnesses", springs.stiffness)
        for values in self.membrane[1:]:
            check_finite("triangle springs", values)
        length = lengths(self.rest, springs.ends) if self.rest_pressure else springs.rest_length
        if not (length > 0).all():
            worst = int(np.argmin(length))
            raise MassSpringError(f"spring {worst} has rest length {length[worst]:g} m; weld its two nodes")
        if self.rest_pressure:
            self._check_balance()

    def _check_balance(self) -> None:
        """Raises MassSpringError unless the rest pressure balances the springs that are taut at rest, at every node."""
        springs, pull, push = self.springs, np.empty_like(self.rest), np.empty_like(self.rest)
        spring_forces_into(self.rest, springs.ends, springs.rest_length, springs.stiffness, pull)
        if isinstance(self.kept, PointVolumes) or self.share is not None:
            push = (self.kept.jacobian(self.rest).T @ self.rest_lam).reshape(-1, 3)
        else:
            volume_gradient_into(self.rest, self.triangles, push)
            push *= self.rest_pressure
        if np.abs(pull + push).max() > BALANCED * np.abs(pull).max():
            raise MassSpringError(
                f"a rest pressure of {self.rest_pressure:g} Pa does not balance the springs at rest; "
                "give springs without length the stiffnesses of the cotangent law, and its mu as the pressure"
            )

    @property
    def node_count(self) -> int:
        """Number of nodes, virtual ones included."""
        return len(self.rest)

    @property
    def surface_nodes(self) -> np.ndarray:
        """Nodes of the closed surface, ascending, (c,) uint32."""
        return np.unique(self.triangles).astype(np.uint32)

    @property
    def facets(self) -> np.ndarray:
        """Facets of the surface, as curved as contact knows them, (f, 3) or (f, 6) uint32."""
        return self.contact_facets if len(self.contact_facets) else self.triangles

    @property
    def volume(self) -> float:
        """Rest volume V0 [m³]."""
        return float(enclosed_volume(self.rest, self.triangles))

    @cached_property
    def kept(self) -> Volumes | PointVolumes:
        """The volumes that methods keep: `volumes`, or the whole."""
        return Volumes.whole(self) if self.volumes is None else self.volumes

    @cached_property
    def rest_volumes(self) -> np.ndarray:
        """V0_r [m³] of the kept volumes, (m,)."""
        return self.kept.measure(self.rest)

    @cached_property
    def rest_lam(self) -> np.ndarray:
        """Multiplier of each kept volume that yields the rest pressure [Pa], (m,): Jᵀ rest_lam = rest_pressure ·
        dV/dx."""
        if not self.rest_pressure:
            return np.zeros(self.kept.count)
        if self.share is not None:  # nodal ones, or those of the pieces; `_check_balance` holds them to it
            return np.full(self.kept.count, self.rest_pressure)
        return self.rest_pressure * self.kept.parts_of(self.triangles)

    @property
    def moved_mass(self) -> np.ndarray:
        """Inertial mass of the nodes [kg], (n,): `inertia` if given, else `mass`."""
        return self.mass if self.inertia is None else self.inertia

    @property
    def rest_energy(self) -> float:
        """Energy at rest of springs that are taut at rest [J]; reported energies are relative to it."""
        springs = self.springs
        return float(spring_energy(self.rest, springs.ends, springs.rest_length, springs.stiffness))

    @cached_property
    def tetrahedron_volumes(self) -> np.ndarray:
        """Rest volumes [m³], (k,)."""
        return tetrahedron_volumes(self.rest, self.tetrahedra)

    @property
    def tissue_volumes(self) -> np.ndarray:
        """Of the tissue in each tetrahedron at rest [m³], (k,)."""
        return self.tetrahedron_volumes if self.share is None else self.tetrahedron_volumes * self.share

    def measured(self, x: np.ndarray) -> Measured:
        """The body at positions `x` (n, 3) [m]."""
        if isinstance(self.kept, PointVolumes):
            j = self.kept.jacobians(x)
            energy = 0.5 * self.local_bulk * (self.kept.weight * (j - 1.0) ** 2).sum()
            return Measured(x, self.kept.volumes_of(j, x), float(j.min()), float(energy))
        least = float("nan")
        if len(self.tetrahedra):
            least = float(smallest_ratio(tetrahedron_volumes(x, self.tetrahedra), self.tetrahedron_volumes))
        return Measured(x, self.kept.measure(x), least, 0.0)

    @cached_property
    def size(self) -> float:
        """Diagonal of the bounding box at rest [m]."""
        return float(np.linalg.norm(np.ptp(self.rest, axis=0)))

    def keeping(self, volumes: Volumes | PointVolumes) -> "Body":
        """The same body with other volumes to keep. Raises MassSpringError for one that is not positive at rest."""
        return replace(self, volumes=volumes)

    def stiffened(self, factor: float) -> "Body":
        """The same body with every spring `factor` times as stiff."""
        stiffer = replace(self.springs, stiffness=self.springs.stiffness * factor)
        membrane = self.membrane._replace(
            stiffness=self.membrane.stiffness * factor, coupling=self.membrane.coupling * factor
        )
        return replace(
            self,
            springs=stiffer,
            rest_pressure=self.rest_pressure * factor,
            local_bulk=self.local_bulk * factor,
            membrane=membrane,
        )
