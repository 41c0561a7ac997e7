"""The end of every step: thin probes, impulses of attachments and obstacles, and the motion of all nodes."""

from massspring.kernels.arrays.layout import Push
from massspring.kernels.jit.decorators import njit_exposed, njit_inlined
from massspring.kernels.jit.stage_clock import HELD, INTEGRATION, PROBES, end_stage
from massspring.kernels.probe.arrays import Stage
from massspring.kernels.probe.stage import meet_probes
from massspring.kernels.step.advance import advance
from massspring.kernels.step.attachments import add_held_impulse


@njit_exposed
def end_step(frame, step, push, mobility, volumes):
    """Contact with thin probes, impulses of attachments and obstacles, v⁺ and x⁺ (eq. 3.5, 3.6, 11.1–11.7).

    `mobility` is G·W̃·G [m⁴/kg] if the method solves for one volume, else 0; `volumes` if it solves for several, else
    None. Returns the factor of the push after contact with probes: for one volume its pressure [Pa].
    """
    factor = probed(frame, step, push, mobility, volumes, frame.probing)
    push = Push(push.direction, factor)
    model, nodes, boundary, diagnostics = frame.model, frame.nodes, frame.boundary, frame.diagnostics
    add_held_impulse(model, nodes, push, boundary.dt, boundary.gravity, diagnostics.held_impulse)
    end_stage(diagnostics.stage_times, HELD)
    advance(frame, push)
    end_stage(diagnostics.stage_times, INTEGRATION)
    return factor


@njit_inlined
def probed(frame, step, push, mobility, volumes, probing):
    """Runs the stage of thin probes if there are any; returns the factor of the push after it."""
    if probing is None:
        return push.factor
    boundary = frame.boundary
    stage = Stage(
        frame.model, frame.nodes, frame.contacts, boundary.tips, probing, volumes, mobility, step, boundary.dt
    )
    factor = meet_probes(stage, volumes, push)
    end_stage(frame.diagnostics.stage_times, PROBES)
    return factor
