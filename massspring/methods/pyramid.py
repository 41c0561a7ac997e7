"""A penalty on the volume summed over pyramids from the centre of mass to each triangle, pushing along normals.

Zordan, Celly, Chiu, DiLorenzo, Breathe easy, Symposium on Computer Animation 2004: force k (V0 − V) along the normal of
each triangle, here in proportion to its area (docs/theory.md, eq. 10.8, 10.10).

Limits: on a closed surface the pyramids add up to the enclosed volume for any apex, so the method *is* the penalty,
with one more sweep. Forces that are not in proportion to area would exert a net force on the body.
"""

from dataclasses import dataclass
from typing import ClassVar

from scipy.sparse import csr_array

from massspring.body.body import Body
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities
from massspring.methods.families.pressure_law import PYRAMIDS, check_modulus, push, volume_stiffness
from massspring.methods.method import Method


@dataclass(frozen=True)
class Pyramid(Method):
    """Pushes each triangle out in proportion to what its pyramids miss together."""

    bulk_modulus: float = 100_000.0
    """K = k V0 [Pa]; the default of `Penalty`, so that the two can be compared."""

    name: ClassVar[str] = "pyramid"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    capabilities: ClassVar[Capabilities] = Capabilities("whole", "penalty", thin_probes=True)

    def __post_init__(self) -> None:
        check_modulus(self.name, "bulk_modulus", self.bulk_modulus)

    def added_stiffness(self, body: Body) -> csr_array:
        """B [√(N/m)], (3n, 1), with B Bᵀ = (K/V0) G Gᵀ."""
        return volume_stiffness(body, self.bulk_modulus)

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        return push(state, boundary, self.bulk_modulus, PYRAMIDS)
