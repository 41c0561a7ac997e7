"""Contact with friction, and of a node with two obstacles at once; impulses of the obstacles (docs/theory.md, section
9)."""

import math

from massspring.kernels.contact.gaps import gap_and_normal, pushed_velocity
from massspring.kernels.contact.node_contact import FREE, ON_EDGE, SLIDES, STICKS, allowed_part, settled
from massspring.kernels.jit.decorators import njit_inlined, njit_lean
from massspring.kernels.jit.vec3 import add_to, cross, dot, minus, over, plus, put, row, take_from, times

SLIPS = 1.0 + 1e-9
"""Factor on the friction limit, so that round-off does not make a sticking node slip."""
LIFTS = 1.0 / 12.0
"""Part of the push on the mid-side nodes next to a corner, with which a plane may pull the corner: there the pressure,
linear over the facets, is zero. Under an even pressure the force on a corner is zero, and its sign is chance."""
PARALLEL = 1e-4
"""Squared sine between two normals (0.6°) below which they count as one: there is no edge to slide along."""


@njit_lean
def apply_friction(model, nodes, contacts, boundary, step, push):
    """Coulomb: a touched node sticks while |s| ≤ mu (a − n·u), else its slip s loses mu (a − n·u) (eq. 9.1)."""
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if contacts.mode[i] != SLIDES or not boundary.friction[contacts.contact_id[i] - 1] > 0.0:
            continue
        o, n, g = contacts.contact_id[i] - 1, row(contacts.normal, i), row(contacts.v_target, i)
        u, w = pushed_velocity(model, nodes, boundary, push, i), row(boundary.velocity[step], o)
        pressed = boundary.friction[o] * dot(minus(g, u), n)
        s = allowed_part(SLIDES, n, minus(u, w))
        slip = math.sqrt(dot(s, s))
        if boundary.friction[o] == math.inf or slip <= pressed:
            contacts.mode[i] = STICKS
            put(contacts.v_target, i, plus(g, allowed_part(SLIDES, n, w)))
        else:
            put(contacts.v_target, i, minus(g, times(pressed / slip, s)))


@njit_lean
def release_slipping(model, nodes, contacts, boundary, push):
    """Makes sticking nodes slip whose tangential impulse with the solved pressure exceeds mu times the normal one (eq.
    9.1)."""
    changes = 0
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if contacts.mode[i] != STICKS:
            continue
        w = boundary.dt * push.factor * model.inverse_mass[i]
        n, g = row(contacts.normal, i), row(contacts.v_target, i)
        gained = minus(minus(g, row(nodes.v_star, i)), times(w, row(push.direction, i)))
        along, s = dot(gained, n), allowed_part(SLIDES, n, gained)
        needed, most = math.sqrt(dot(s, s)), boundary.friction[contacts.contact_id[i] - 1] * along
        if along > 0.0 and needed > SLIPS * most:
            contacts.mode[i] = SLIDES
            put(contacts.v_target, i, plus(times(dot(g, n), n), times(most / needed, s)))
            changes += 1
    return changes


@njit_inlined
def onto_edge(contacts, i, a, b, edge):
    """Node i moves along `edge` alone: v_target = alpha n + beta m with n·v_target = a and m·v_target = b."""
    n, m = row(contacts.normal, i), row(contacts.second_normal, i)
    square, cosine = dot(edge, edge), dot(n, m)
    alpha, beta = (a - cosine * b) / square, (b - cosine * a) / square
    put(contacts.direction, i, over(edge, math.sqrt(square)))
    put(contacts.v_target, i, plus(times(alpha, n), times(beta, m)))


@njit_lean
def activate_edges(model, nodes, contacts, boundary, step, push):
    """Puts touched nodes that would enter a second obstacle on the edge e = n × n' of both (eq. 9.2); returns how many.

    Obstacles that face each other have no edge: the deeper one wins, and the other's penetration is recorded.
    """
    changes, dt, place = 0, boundary.dt, boundary.position[step]
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if contacts.mode[i] != SLIDES:
            continue
        n, u = row(contacts.normal, i), pushed_velocity(model, nodes, boundary, push, i)
        u = plus(allowed_part(SLIDES, n, u), row(contacts.v_target, i))
        y, deepest = plus(row(nodes.x, i), times(dt, u)), 0.0
        for o in range(boundary.radius.shape[0]):
            if o + 1 == contacts.contact_id[i] or boundary.inside[o]:
                continue
            gap, m = gap_and_normal(boundary, o, minus(y, row(place, o)))
            edge = cross(n, m)
            if gap < deepest and dot(edge, edge) > PARALLEL:
                deepest = gap
                contacts.second[i] = o + 1
                put(contacts.second_normal, i, m)
                onto_edge(contacts, i, dot(n, u), dot(m, u) - gap / dt, edge)
        if deepest < 0.0:
            contacts.mode[i] = ON_EDGE
            changes += 1
    return changes


@njit_lean
def impulse_shares(k, n, m):
    """The parts of k = α n + β n' + rest along two normals that are not parallel, tuples of three numbers: (α, β)."""
    along, other, cosine = dot(k, n), dot(k, m), dot(n, m)
    square = 1.0 - cosine * cosine
    return (along - cosine * other) / square, (other - cosine * along) / square


@njit_inlined
def push_of(model, nodes, contacts, boundary, push, i, o):
    """The impulse on a node that touches obstacle `o` − 1, along its normal [N s]."""
    missing = minus(row(contacts.v_target, i), pushed_velocity(model, nodes, boundary, push, i))
    along = dot(missing, row(contacts.normal, i))
    if contacts.mode[i] == ON_EDGE:
        along, other = impulse_shares(missing, row(contacts.normal, i), row(contacts.second_normal, i))
        if contacts.contact_id[i] != o:
            along = other
    return model.mass[i] * along


@njit_inlined
def is_held_down(model, nodes, contacts, boundary, push, i, o):
    """Whether a corner that obstacle `o` − 1 pulls stays: f_c ≥ −Σ f_m / 12 over the mid-side nodes m next to it (eq.
    3.8b)."""
    pressed = 0.0
    for k in range(contacts.beside_start[i], contacts.beside_start[i + 1]):
        j = contacts.beside[k]
        touches = contacts.mode[j] > FREE and contacts.contact_id[j] == o
        if touches or (contacts.mode[j] == ON_EDGE and contacts.second[j] == o):
            pressed += max(0.0, push_of(model, nodes, contacts, boundary, push, j, o))
    return pressed > 0.0 and push_of(model, nodes, contacts, boundary, push, i, o) >= -LIFTS * pressed


@njit_lean
def release_edges(model, nodes, contacts, boundary, push):
    """Releases nodes on an edge that one of the two obstacles would pull; the next search finds the other obstacle (eq.
    9.2)."""
    changes = 0
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if contacts.mode[i] != ON_EDGE:
            continue
        u = pushed_velocity(model, nodes, boundary, push, i)
        # The free direction along the edge is orthogonal to both normals and does not contribute.
        missing = minus(row(contacts.v_target, i), u)
        alpha, beta = impulse_shares(missing, row(contacts.normal, i), row(contacts.second_normal, i))
        first, second = contacts.contact_id[i], contacts.second[i]
        if (alpha < 0.0 and not is_held_down(model, nodes, contacts, boundary, push, i, first)) or (
            beta < 0.0 and not is_held_down(model, nodes, contacts, boundary, push, i, second)
        ):
            contacts.contact_id[i], contacts.mode[i], contacts.predicted_gap[i] = 0, FREE, 0.0
            changes += 1
    return changes


@njit_inlined
def book_contacts(model, nodes, contacts, push, dt, contact_impulse):
    """Adds the impulse of each obstacle, m (v⁺ − u) [N s] (eq. 3.5); u is the velocity without contact."""
    mode, real = contacts.mode, nodes.x.dtype.type
    impulse = real(dt * push.factor)
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if mode[i] == FREE:
            continue
        w = impulse * real(model.inverse_mass[i])
        u = plus(row(nodes.v_star, i), times(w, row(push.direction, i)))
        o, gained = contacts.contact_id[i] - 1, times(model.mass[i], minus(settled(contacts, i, u), u))
        add_to(contact_impulse, o, gained)
        if mode[i] == ON_EDGE:
            # Both obstacles of an edge push: the part along the second normal is the second's.
            m = row(contacts.second_normal, i)
            _, beta = impulse_shares(gained, row(contacts.normal, i), m)
            take_from(contact_impulse, o, times(beta, m))
            add_to(contact_impulse, contacts.second[i] - 1, times(beta, m))
