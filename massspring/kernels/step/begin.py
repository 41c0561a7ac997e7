"""The beginning of every step: prediction, prescribed motion, and the search for contacts."""

from massspring.kernels.contact.active_set import CONTACT_PASSES, find_contacts, revise_contacts
from massspring.kernels.fused.chunk import pad_positions
from massspring.kernels.fused.sweep import predict_from_places
from massspring.kernels.jit.decorators import compiled, njit_exposed, njit_inlined, njit_lean
from massspring.kernels.jit.stage_clock import BETWEEN_FRAMES, HELD, MULTIPLIER, REVISION, SEARCH, SPRINGS, end_stage
from massspring.kernels.jit.vec3 import add_to, dot, minus, put, row, times


@njit_lean
def prescribe_velocity_into(x, held_nodes, held_group, held_rest, displacement, dt, v_star):
    """v*_i = (X_i + d_g − x_i)/dt [m/s] for every held node: it ends the step where its attachment is (eq. 3.2)."""
    for h in range(held_nodes.shape[0]):
        i = held_nodes[h]
        g = held_group[h]
        for axis in range(3):
            v_star[i, axis] = (held_rest[h, axis] + displacement[g, axis] - x[i, axis]) / dt


@njit_exposed
def prescribe(model, nodes, displacement, dt):
    """v* of held nodes (eq. 3.2); returns the change of G·v* [m³/s]."""
    held_nodes, groups, rest = model.held_nodes, model.held_group, model.held_rest
    x, v_star, gradient = nodes.x, nodes.v_star, nodes.gradient
    flow, per_step = 0.0, 1.0 / dt
    for h in range(held_nodes.shape[0]):
        i, g = held_nodes[h], groups[h]
        for axis in range(3):
            held = per_step * (rest[h, axis] + displacement[g, axis] - x[i, axis])
            flow += gradient[i, axis] * (held - v_star[i, axis])
            v_star[i, axis] = held
    return flow


@compiled
def add_to_prediction(model, nodes, force, dt):
    """v* += dt W f [m/s] for one more force [N], (n, 3), which is also added to the force on held nodes (eq. 3.1,
    3.6)."""
    for i in range(force.shape[0]):
        add_to(nodes.v_star, i, times(dt * model.inverse_mass[i], row(force, i)))
    for h in range(model.held_nodes.shape[0]):
        i = model.held_nodes[h]
        add_to(nodes.force, i, row(force, i))


@njit_inlined
def worked(impulse, earlier, velocity, step):
    """Work [J] of the impulses (k, 3) of step − 1 at the velocities (q, k, 3) of that step; then keeps the impulses."""
    work = 0.0
    for k in range(velocity.shape[1]):
        if step > 0:
            work += dot(minus(row(impulse, k), row(earlier, k)), row(velocity[step - 1], k))
        put(earlier, k, row(impulse, k))
    return work


@njit_exposed
def look_back(diagnostics, boundary, step):
    """Adds the work of the step before, and keeps the impulses so far: at the end of a frame, the rest is of its last
    step."""
    o, tips = boundary.velocity.shape[1], boundary.tips
    contact, earlier = diagnostics.contact_impulse, diagnostics.earlier_contact
    work = worked(contact, earlier, boundary.velocity, step)
    work += worked(diagnostics.held_impulse, diagnostics.earlier_held, boundary.held_velocity, step)
    for p in range(tips.end.shape[1]):
        if step > 0:
            way = minus(row(tips.end[step - 1], p), row(tips.start[step - 1], p))
            work += dot(minus(row(contact, o + p), row(earlier, o + p)), times(1.0 / boundary.dt, way))
        put(earlier, o + p, row(contact, o + p))
    diagnostics.work[0] += work


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
    look_back(frame.diagnostics, boundary, step)
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
    look_back(frame.diagnostics, boundary, step)
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
