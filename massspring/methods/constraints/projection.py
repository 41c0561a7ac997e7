"""Projection of the predicted positions onto the constant volume.

Promayon, Baconnier, Puech, Computer Graphics Forum 15 (1996) and CVRMed-MRCAS (1997; "PBP97"): move all nodes along
the volume gradient of the *predicted* shape until the volume is right; velocities follow. The step length is the root
of the cubic (docs/theory.md, eq. 10.1–10.3).

Limits: the pressure acts along a gradient that is a step ahead of the positions, so that under sustained pressure and
without damping the body gains energy at the rate of eq. 10.4, and angular momentum if it turns. HCJ05 and SHAKE gain
neither.
"""

from dataclasses import dataclass
from typing import ClassVar

from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities
from massspring.methods.families.one_volume import Rule, advance_by
from massspring.methods.method import Method


@dataclass(frozen=True)
class Projection(Method):
    """Projects each predicted shape onto the right volume, along that shape's own gradient."""

    name: ClassVar[str] = "projection"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = 1e-12
    conserves_angular_momentum: ClassVar[bool] = False
    capabilities: ClassVar[Capabilities] = Capabilities("whole", "full", thin_probes=True)

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        return advance_by(Rule(exact=True, at_prediction=True), state, boundary)
