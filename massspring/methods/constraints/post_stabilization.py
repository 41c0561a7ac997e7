"""A constraint on the velocities, and a correction of the positions after every step.

Cline and Pai, IEEE International Conference on Robotics and Automation (2003). First dV/dt = 0 at the end of the step,
then x += W̃ G (V0 − V)/(G·W̃·G) at the new positions, velocities untouched (docs/theory.md, eq. 10.3, 10.7).

Limits: the correction ignores the dynamics. It moves nodes without a change of velocity, which excites the springs
slightly and does not conserve angular momentum exactly. Only the positions follow a moving target.
"""

from dataclasses import dataclass
from typing import ClassVar

from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities, No
from massspring.methods.families.one_volume import Rule, advance_by
from massspring.methods.method import Method


@dataclass(frozen=True)
class PostStabilization(Method):
    """Keeps the volume's rate by a pressure, and the volume itself by moving nodes afterwards."""

    name: ClassVar[str] = "post_stabilization"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = 1e-4
    conserves_angular_momentum: ClassVar[bool] = False
    capabilities: ClassVar[Capabilities] = Capabilities(
        "whole",
        "limited",
        thin_probes=No("it moves nodes once more after the step, where no probe is looked for"),
    )

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        return advance_by(Rule(pull=0.0, stabilised=True), state, boundary)
