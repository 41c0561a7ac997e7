"""A penalty on the whole volume: a pressure in proportion to the missing volume, lam = K (V0 − V)/V0.

The oldest approach; as a constraint on volumes of deformable bodies: Platt and Barr, SIGGRAPH 1988; Hong et al. 2005
compare themselves with it (docs/theory.md, eq. 10.8).

Limits: a pressure lam costs lam/K of the volume, so the residual is ∝ 1/K; a large K shortens the step,
omega² grows by K G·W·G/V0 (eq. 10.9).
"""

from dataclasses import dataclass
from typing import ClassVar

from scipy.sparse import csr_array

from massspring.body.body import Body
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities
from massspring.methods.families.pressure_law import PENALTY, check_modulus, push, volume_stiffness
from massspring.methods.method import Method


@dataclass(frozen=True)
class Penalty(Method):
    """Pushes the surface out in proportion to the missing volume."""

    bulk_modulus: float = 100_000.0
    """K [Pa]. 100 kPa is 56 times a liver's shear modulus: a ball of liver pressed by a third loses about 1 % of its
    volume. On 300 to 550 surface nodes it shortens the step by 0 to 45 %; ten times as much by 70 to 80 %."""

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
        return push(state, boundary, self.bulk_modulus, PENALTY)
