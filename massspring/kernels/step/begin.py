"""The beginning of every step: the prediction before the volumes are solved for, and the search for contacts."""

from massspring.kernels.contact.active_set import CONTACT_PASSES, find_contacts, revise_contacts
from massspring.kernels.fused.padded import pad_positions
from massspring.kernels.fused.sweep import predict_from_places
from massspring.kernels.jit.decorators import njit_exposed, njit_inlined
from massspring.kernels.jit.stage_clock import BETWEEN_FRAMES, HELD, MULTIPLIER, REVISION, SEARCH, SPRINGS, end_stage
from massspring.kernels.step.attachments import prescribe, prescribe_velocity_into


@njit_exposed
def open_frame(frame):
    """Records the time between two frames, and pads the positions for the first step."""
    end_stage(frame.diagnostics.stage_times, BETWEEN_FRAMES)
    pad_positions(frame.nodes, frame.work, 0, frame.nodes.x.shape[0])


@njit_exposed
def begin_step(frame, step, keeps):
    """v* of springs, damping, gravity and held nodes (eq. 1.1, 3.1, 3.2) and, where one volume is kept, G.

    Returns V [m³] and G·W·G [m⁴/kg].
    """
    model, nodes, boundary = frame.model, frame.nodes, frame.boundary
    volume, _, mobility = predict_from_places(model, nodes, frame.work, boundary, keeps)
    end_stage(frame.diagnostics.stage_times, SPRINGS)
    held = boundary.held_displacement[step]
    prescribe_velocity_into(
        nodes.x, model.held_nodes, model.held_group, model.held_rest, held, boundary.dt, nodes.v_star
    )
    end_stage(frame.diagnostics.stage_times, HELD)
    return volume, mobility


@njit_inlined
def begin_summed_step(frame, step):
    """`begin_step` with G, which also sums G·v* [m³/s] over all nodes in the same pass: (V, G·v*, G·W·G)."""
    model, nodes, boundary = frame.model, frame.nodes, frame.boundary
    volume, flow, mobility = predict_from_places(model, nodes, frame.work, boundary, True)
    end_stage(frame.diagnostics.stage_times, SPRINGS)
    flow += prescribe(model, nodes, boundary.held_displacement[step], boundary.dt)
    end_stage(frame.diagnostics.stage_times, HELD)
    return volume, flow, mobility


@njit_exposed
def search_contacts(frame, step, push):
    """Finds the nodes that touch with the push of the last step (eq. 3.7). Returns how many passes the active set may
    take."""
    if frame.boundary.radius.shape[0] == 0:
        return 1
    find_contacts(frame.model, frame.nodes, frame.contacts, frame.boundary, step, push)
    end_stage(frame.diagnostics.stage_times, SEARCH)
    return CONTACT_PASSES


@njit_inlined
def multiplier_stands(frame, step, push, reach, last):
    """Whether the new push leaves the set of touched nodes unchanged (eq. 3.8), or this was the last pass.

    `reach` [m]: how far the new push can have moved a node; if contacts change, the caller solves for the multiplier
    again.
    """
    end_stage(frame.diagnostics.stage_times, MULTIPLIER)
    if last:
        return True
    changes = revise_contacts(frame.model, frame.nodes, frame.contacts, frame.boundary, step, push, reach)
    end_stage(frame.diagnostics.stage_times, REVISION)
    return changes == 0


@njit_inlined
def count_iterations(diagnostics, count):
    """Records the iterations of one solve for multipliers."""
    diagnostics.iterations[0] += count
    diagnostics.iterations[1] = max(diagnostics.iterations[1], count)
