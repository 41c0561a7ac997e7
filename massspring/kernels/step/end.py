"""The end of every step: thin probes, impulses of attachments and obstacles, and the motion of all nodes."""

from massspring.kernels.arrays.layout import Push
from massspring.kernels.contact.friction import book_contacts
from massspring.kernels.contact.node_contact import FREE, settled
from massspring.kernels.fused.chunk import pad_positions
from massspring.kernels.jit.decorators import njit_exposed, njit_inlined
from massspring.kernels.jit.flat import flat
from massspring.kernels.jit.stage_clock import HELD, INTEGRATION, PROBES, end_stage
from massspring.kernels.jit.vec3 import plus, put, row, times
from massspring.kernels.probe.arrays import Stage
from massspring.kernels.probe.stage import meet_probes

NEAR = 4096
"""Nodes per block: new positions are padded while they are still in the second-level cache."""


@njit_inlined
def advance_nodes(nodes, contacts, work, inverse_mass, push, dt, first, last):
    """v⁺ = ṽ + dt W̃ f, x⁺ = x + dt v⁺ (eq. 3.5) of the nodes first ≤ i < last.

    `padded_positions` holds x at the start of the step.
    """
    flat_x, flat_v = flat(nodes.x, first, last), flat(nodes.v, first, last)
    flat_v_star, direction = flat(nodes.v_star, first, last), flat(push.direction, first, last)
    weights, mode, real = flat(inverse_mass, first, last), contacts.mode, nodes.x.dtype.type
    step, impulse = real(dt), real(dt * push.factor)
    for i in range(weights.shape[0]):
        w = impulse * real(weights[i])
        for axis in range(3):
            u = flat_v_star[3 * i + axis] + w * direction[3 * i + axis]
            flat_v[3 * i + axis] = u
            flat_x[3 * i + axis] += step * u
    x, v = nodes.x, nodes.v
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if first <= i < last and mode[i] > FREE:
            put(v, i, settled(contacts, i, row(v, i)))
            put(x, i, plus(row(work.padded_positions, i), times(step, row(v, i))))


@njit_exposed
def advance(frame, push):
    """The end of a step of all nodes (eq. 3.5); adds the impulse of each obstacle and pads the new positions."""
    model, nodes, contacts, work, dt = frame.model, frame.nodes, frame.contacts, frame.work, frame.boundary.dt
    book_contacts(model, nodes, contacts, push, dt, frame.diagnostics.contact_impulse)
    n = nodes.x.shape[0]
    for begin in range(0, n, NEAR):
        end = min(begin + NEAR, n)
        advance_nodes(nodes, contacts, work, model.inverse_mass, push, dt, begin, end)
        pad_positions(nodes, work, begin, end)


@njit_exposed
def add_held_impulse(model, nodes, push, dt, gravity, held_impulse):
    """I_g = −dt Σ_i∈g (f_i + push_i + m_i g) [N s]: impulse of an attachment on the body, without the inertia of held
    nodes (eq. 3.6)."""
    held_nodes, groups, mass = model.held_nodes, model.held_group, model.mass
    h, count = 0, held_nodes.shape[0]
    while h < count:
        g, carried, force = groups[h], 0.0, (0.0, 0.0, 0.0)
        while h < count and groups[h] == g:
            i = held_nodes[h]
            force = plus(force, plus(row(nodes.force, i), times(push.factor, row(push.direction, i))))
            carried += mass[i]
            h += 1
        for axis in range(3):
            held_impulse[g, axis] -= dt * (force[axis] + carried * gravity[axis])


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
