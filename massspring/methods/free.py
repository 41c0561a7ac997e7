"""Springs only, without volume constraint: the baseline of the paper."""

from dataclasses import dataclass
from typing import ClassVar

from massspring.kernels.arrays.layout import BoundaryConditions, Push
from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.step.begin import begin_step, open_frame, search_contacts
from massspring.kernels.step.end import end_step
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities
from massspring.methods.method import Method, begin_frame


@njit_lean
def free_frame(frame):
    """One frame of symplectic Euler with contact (eq. 3.1, 3.2, 3.5, 3.7)."""
    nothing = Push(frame.nodes.gradient, 0.0)
    open_frame(frame)
    for step in range(frame.boundary.position.shape[0]):
        begin_step(frame, step, False)
        search_contacts(frame, step, nothing)
        end_step(frame, step, nothing, 0.0, None)


@dataclass(frozen=True)
class Free(Method):
    """Symplectic Euler, no volume kept."""

    name: ClassVar[str] = "free"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    capabilities: ClassVar[Capabilities] = Capabilities("none", thin_probes=True, float32=True)

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        after = begin_frame(state, boundary)
        free_frame(after.frame(boundary))
        return after
