"""SHAKE for one enclosed volume: the direction of HCJ05, the step along it to the exact volume.

Ryckaert, Ciccotti, Berendsen, Journal of Computational Physics 23 (1977), for bond lengths; here the constraint is a
cubic along the line, so its root has a closed form and needs no iteration (docs/theory.md, eq. 10.1, 10.2). HCJ05 is
one Newton step of it.
"""

from dataclasses import dataclass
from typing import ClassVar

from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities
from massspring.methods.families.one_volume import Rule, advance_by
from massspring.methods.method import Method


@dataclass(frozen=True)
class Shake(Method):
    """Pushes along the old volume gradient exactly so far that the step ends at V0."""

    name: ClassVar[str] = "shake"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = 1e-12
    capabilities: ClassVar[Capabilities] = Capabilities("whole", "full", thin_probes=True)

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        return advance_by(Rule(exact=True), state, boundary)
