"""Time stepping: symplectic Euler, prescribed nodes, and the multiplier of one volume."""

from massspring.kernels.contact.bookkeeping import book_contacts, settled
from massspring.kernels.contact.modes import FREE
from massspring.kernels.fused.padded import places_into
from massspring.kernels.jit.decorators import inlined, lean
from massspring.kernels.jit.flat import flat
from massspring.kernels.jit.thread_team import JOB_MOVE, call, join

NEAR = 4096
"""Nodes of which a step's end fits the second cache."""


@inlined
def advance_nodes(motion, inverse_mass, push, dt, first, last):
    """v⁺ = ṽ + dt W̃ f, x⁺ = x + dt v⁺ (eq. 10) of some nodes; `places` holds the x of the step's start."""
    flat_x, flat_v = flat(motion.x, first, last), flat(motion.v, first, last)
    flat_v_star, direction = flat(motion.v_star, first, last), flat(push.direction, first, last)
    weights, locked, real = flat(inverse_mass, first, last), motion.locked, motion.x.dtype.type
    step, impulse = real(dt), real(dt * push.factor)
    for i in range(weights.shape[0]):
        w = impulse * real(weights[i])
        for axis in range(3):
            u = flat_v_star[3 * i + axis] + w * direction[3 * i + axis]
            flat_v[3 * i + axis] = u
            flat_x[3 * i + axis] += step * u
    x, v, places = motion.x, motion.v, motion.places
    for k in range(motion.touching_count[0]):
        i = motion.touching[k]
        if first <= i < last and locked[i] > FREE:
            v[i, 0], v[i, 1], v[i, 2] = settled(motion, i, v[i, 0], v[i, 1], v[i, 2])
            for axis in range(3):
                x[i, axis] = places[i, axis] + step * v[i, axis]


@lean
def advance(motion, mass, inverse_mass, push, dt, contact_impulse):
    """The end of a step of all nodes (eq. 10); adds the impulse of each obstacle to `contact_impulse`."""
    book_contacts(motion, mass, inverse_mass, push, dt, contact_impulse)
    advance_nodes(motion, inverse_mass, push, dt, 0, motion.x.shape[0])


@inlined
def advance_to_places(motion, mass, inverse_mass, push, dt, contact_impulse):
    """The same, by as many threads as there are; `places` holds the new positions too."""
    book_contacts(motion, mass, inverse_mass, push, dt, contact_impulse)
    move_all(motion, inverse_mass, push, dt, motion.team)


@inlined
def move_all(motion, inverse_mass, push, dt, team):
    """`advance_nodes` and `places_into` of all nodes, by as many threads as there are."""
    if team is None:
        move(motion, inverse_mass, push, dt, 0, motion.x.shape[0])
    else:
        call(team, JOB_MOVE, 0, push.factor)
        move(motion, inverse_mass, push, dt, team.nodes[0], team.nodes[1])
        join(team)


@inlined
def move(motion, inverse_mass, push, dt, first, last):
    """`advance_nodes` and `places_into` of some nodes; `NEAR` at a time, so that new positions are still at hand."""
    for begin in range(first, last, NEAR):
        end = min(begin + NEAR, last)
        advance_nodes(motion, inverse_mass, push, dt, begin, end)
        places_into(motion, begin, end)
