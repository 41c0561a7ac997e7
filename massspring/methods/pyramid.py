"""A penalty on the volume summed over pyramids from the centre of mass to each triangle, pushing along normals.

Zordan, Celly, Chiu, DiLorenzo, Breathe easy, Symposium on Computer Animation 2004: force k (V0 − V) along the normal of
each triangle, here in proportion to its area (docs/theory.md, eq. 10.8, 10.10).

Limits: on a closed surface the pyramids add up to the enclosed volume wherever their apex is, so that it *is* the
penalty, at the price of one more sweep. Forces that are not in proportion to area would push the body about.
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
    """K = k V0 [Pa]; that of the penalty, so that the two can be compared."""

    name: ClassVar[str] = "pyramid"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    capabilities: ClassVar[Capabilities] = Capabilities("whole", "penalty", thin_probes=True)

    def __post_init__(self) -> None:
        check_modulus(self.name, "bulk_modulus", self.bulk_modulus)

    def added_stiffness(self, body: Body) -> csr_array:
        """(K/V0) G Gᵀ, of rank one."""
        return volume_stiffness(body, self.bulk_modulus)

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        """One frame."""
        return push(state, boundary, self.bulk_modulus, PYRAMIDS)
