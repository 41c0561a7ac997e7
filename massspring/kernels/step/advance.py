"""The end of a step: symplectic Euler for all nodes, and the impulses of obstacles."""

from massspring.kernels.contact.bookkeeping import book_contacts
from massspring.kernels.contact.constrained_motion import settled
from massspring.kernels.contact.modes import FREE
from massspring.kernels.fused.padded import pad_positions
from massspring.kernels.jit.decorators import njit_exposed, njit_inlined
from massspring.kernels.jit.flat import flat
from massspring.kernels.jit.vec3 import plus, put, row, times

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
