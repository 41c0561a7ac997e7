"""Methods whose pressure is a function of the current volume (docs/theory.md, eq. 10.8)."""

from dataclasses import dataclass
from typing import ClassVar

from scipy.sparse import csr_array

from massspring.body.body import Body
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities
from massspring.methods.families.pressure_law import GAS, PENALTY, PYRAMIDS, check_modulus, push, volume_stiffness
from massspring.methods.method import Method


@dataclass(frozen=True)
class Penalty(Method):
    """Pushes the surface out in proportion to the missing volume.

    lam = K (V0 − V)/V0, the oldest approach; as a constraint on volumes of deformable bodies: Platt and Barr, SIGGRAPH
    1988; Hong et al. 2005 compare themselves with it (docs/theory.md, eq. 10.8).

    Limits: a pressure lam costs lam/K of the volume, so the residual is ∝ 1/K; a large K shortens the step,
    omega² grows by K G·W·G/V0 (eq. 10.9).
    """

    bulk_modulus: float = 100_000.0
    """K [Pa]. 100 kPa is 56 times a liver's shear modulus: a ball of liver pressed by a third loses about 1 % of its
    volume. On 300 to 550 surface nodes it shortens the step by 0 to 45 %; ten times as much by 70 to 80 %."""

    law: ClassVar[int] = PENALTY
    name: ClassVar[str] = "penalty"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    capabilities: ClassVar[Capabilities] = Capabilities("whole", "penalty", thin_probes=True)

    def __post_init__(self) -> None:
        check_modulus(self.name, "bulk_modulus", self.bulk_modulus)

    def added_stiffness(self, body: Body) -> csr_array:
        """B [√(N/m)], (3n, 1), with B Bᵀ = (K/V0) G Gᵀ."""
        return volume_stiffness(body, self.bulk_modulus)

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        return push(state, boundary, self.bulk_modulus, self.law)


@dataclass(frozen=True)
class Pressure(Method):
    """Fills the surface with a gas.

    An ideal gas at constant temperature, in an ambient pressure: lam = p0 (V0/V − 1). Matyka and Ollila, Pressure model
    of soft body simulation, SIGRAD 2003, with p = nRT/V; nRT = p0 V0 makes the rest shape an equilibrium
    (docs/theory.md, eq. 10.8).

    Limits: the volume is not kept: lam/p0 of it is lost, as with a penalty. The pressure grows without bound as V goes
    to 0, so a crushed body bursts.
    """

    ambient: float = 101_325.0
    """p0 [Pa], the gas's bulk modulus at rest. At sea level: 56 times a liver's shear modulus, and within
    2 % of the penalty's default."""

    name: ClassVar[str] = "pressure"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    capabilities: ClassVar[Capabilities] = Capabilities("whole", "unbounded", thin_probes=True)

    def __post_init__(self) -> None:
        check_modulus(self.name, "ambient", self.ambient)

    def added_stiffness(self, body: Body) -> csr_array:
        """B [√(N/m)], (3n, 1), with B Bᵀ = (p0/V0) G Gᵀ."""
        return volume_stiffness(body, self.ambient)

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        return push(state, boundary, self.ambient, GAS)


@dataclass(frozen=True)
class Pyramid(Penalty):
    """Pushes each triangle out in proportion to what its pyramids miss together.

    Pyramids from the centre of mass to each triangle: Zordan, Celly, Chiu, DiLorenzo, Breathe easy, Symposium on
    Computer Animation 2004: force k (V0 − V) along the normal of each triangle, here in proportion to its area
    (docs/theory.md, eq. 10.8, 10.10).

    Limits: on a closed surface the pyramids add up to the enclosed volume for any apex, so the method *is* the penalty,
    with one more sweep. Forces that are not in proportion to area would exert a net force on the body.
    """

    law: ClassVar[int] = PYRAMIDS
    name: ClassVar[str] = "pyramid"
