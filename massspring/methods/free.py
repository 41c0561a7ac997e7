"""Springs only: nothing keeps the volume. What the paper compares itself with."""

from dataclasses import dataclass
from typing import ClassVar

from massspring.kernels.arrays.layout import Drive, Push
from massspring.kernels.contact.active_set import find_contacts
from massspring.kernels.fused.padded import places_into
from massspring.kernels.fused.sweep import predict_from_places
from massspring.kernels.jit.decorators import lean
from massspring.kernels.jit.stage_clock import HELD, INTEGRATION, OUTSIDE, PROBES, SEARCH, SPRINGS, mark
from massspring.kernels.probe.stage import meet_probes
from massspring.kernels.step.advance import advance_to_places
from massspring.kernels.step.attachments import add_held_impulse, prescribe_velocity_into
from massspring.layout.state import State
from massspring.methods.method import Method, crewed_frame


@lean
def free_frame(network, motion, drive, tally, probing):
    """One frame of symplectic Euler with contact (eq. 6, 7, 10, 12)."""
    dt, push = drive.dt, Push(motion.gradient, 0.0)
    mark(tally.ticks, OUTSIDE)
    places_into(motion, 0, motion.x.shape[0])
    for step in range(drive.position.shape[0]):
        predict_from_places(network, motion, drive, False)
        mark(tally.ticks, SPRINGS)
        held = drive.held_displacement[step]
        prescribe_velocity_into(
            motion.x, network.held_nodes, network.held_group, network.held_rest, held, dt, motion.v_star
        )
        mark(tally.ticks, HELD)
        if drive.radius.shape[0] > 0:
            find_contacts(network, motion, drive, step, push)
            mark(tally.ticks, SEARCH)
        if probing is not None:
            meet_probes(network, motion, drive, step, probing, push, 0.0, None)
            mark(tally.ticks, PROBES)
        add_held_impulse(network, motion, push, dt, drive.gravity, tally.held_impulse)
        mark(tally.ticks, HELD)
        advance_to_places(motion, network.mass, network.inverse_mass, push, dt, tally.contact_impulse)
        mark(tally.ticks, INTEGRATION)


@dataclass(frozen=True)
class Free(Method):
    """Symplectic Euler, no volume kept."""

    name: ClassVar[str] = "free"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    follows_targets: ClassVar[bool] = False
    misses_probes: ClassVar[str | None] = None
    threaded: ClassVar[bool] = True

    def advance(self, state: State, drive: Drive) -> State:
        """One frame."""
        with crewed_frame(state, drive) as after:
            free_frame(after.network, after.motion, drive, after.tally, after.probing)
        return after
