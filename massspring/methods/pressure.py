"""An ideal gas inside the surface at constant temperature, in an ambient pressure: lam = p0 (V0/V − 1).

Matyka and Ollila, Pressure model of soft body simulation, SIGRAD 2003, with p = nRT/V; nRT = p0 V0 makes the rest shape
an equilibrium (docs/theory.md, eq. 10.8).

Limits: the volume is not kept: lam/p0 of it is lost, as with a penalty. The pressure grows without bound as V goes to
0, so a crushed body bursts.
"""

from dataclasses import dataclass
from typing import ClassVar

from scipy.sparse import csr_array

from massspring.body.body import Body
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities
from massspring.methods.families.pressure_law import GAS, check_modulus, push, volume_stiffness
from massspring.methods.method import Method


@dataclass(frozen=True)
class Pressure(Method):
    """Fills the surface with a gas."""

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
