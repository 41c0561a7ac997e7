"""Contact with friction, and of a node with two obstacles at once (docs/theory.md, section 9)."""

import math

from massspring.kernels.contact.gaps import gap_and_normal, pushed_velocity
from massspring.kernels.contact.modes import FREE, ON_EDGE, SLIDES, STICKS
from massspring.kernels.contact.node_contact import allowed_part
from massspring.kernels.jit.decorators import njit_inlined, njit_lean

SLIPS = 1.0 + 1e-9
"""Factor on the friction limit, so that round-off does not make a sticking node slip."""
PARALLEL = 1e-4
"""Squared sine between two normals (0.6°) below which they count as one: there is no edge to slide along."""


@njit_lean
def apply_friction(model, nodes, contacts, boundary, step, push):
    """Coulomb: a touched node sticks while |s| ≤ mu (a − n·u), else its slip s loses mu (a − n·u) (eq. 9.1)."""
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if contacts.mode[i] != SLIDES or not boundary.friction[contacts.contact_id[i] - 1] > 0.0:
            continue
        o = contacts.contact_id[i] - 1
        n0, n1, n2 = contacts.normal[i, 0], contacts.normal[i, 1], contacts.normal[i, 2]
        u0, u1, u2 = pushed_velocity(model, nodes, boundary, push, i)
        g0, g1, g2 = contacts.v_target[i, 0], contacts.v_target[i, 1], contacts.v_target[i, 2]
        pressed = boundary.friction[o] * ((g0 - u0) * n0 + (g1 - u1) * n1 + (g2 - u2) * n2)
        w0, w1, w2 = boundary.velocity[step, o, 0], boundary.velocity[step, o, 1], boundary.velocity[step, o, 2]
        s0, s1, s2 = allowed_part(SLIDES, n0, n1, n2, u0 - w0, u1 - w1, u2 - w2)
        slip = math.sqrt(s0 * s0 + s1 * s1 + s2 * s2)
        if slip <= pressed:
            w0, w1, w2 = allowed_part(SLIDES, n0, n1, n2, w0, w1, w2)
            contacts.mode[i] = STICKS
            contacts.v_target[i, 0], contacts.v_target[i, 1], contacts.v_target[i, 2] = g0 + w0, g1 + w1, g2 + w2
        else:
            lost = pressed / slip
            contacts.v_target[i, 0], contacts.v_target[i, 1], contacts.v_target[i, 2] = (
                g0 - lost * s0,
                g1 - lost * s1,
                g2 - lost * s2,
            )


@njit_lean
def release_slipping(model, nodes, contacts, boundary, push):
    """Makes sticking nodes slip whose tangential impulse with the solved pressure exceeds mu times the normal one (eq.
    9.1)."""
    changes = 0
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if contacts.mode[i] != STICKS:
            continue
        w, direction = boundary.dt * push.factor * model.inverse_mass[i], push.direction
        n0, n1, n2 = contacts.normal[i, 0], contacts.normal[i, 1], contacts.normal[i, 2]
        k0 = contacts.v_target[i, 0] - nodes.v_star[i, 0] - w * direction[i, 0]
        k1 = contacts.v_target[i, 1] - nodes.v_star[i, 1] - w * direction[i, 1]
        k2 = contacts.v_target[i, 2] - nodes.v_star[i, 2] - w * direction[i, 2]
        along = k0 * n0 + k1 * n1 + k2 * n2
        s0, s1, s2 = allowed_part(SLIDES, n0, n1, n2, k0, k1, k2)
        needed, most = math.sqrt(s0 * s0 + s1 * s1 + s2 * s2), boundary.friction[contacts.contact_id[i] - 1] * along
        if along > 0.0 and needed > SLIPS * most:
            a = contacts.v_target[i, 0] * n0 + contacts.v_target[i, 1] * n1 + contacts.v_target[i, 2] * n2
            g0, g1, g2 = a * n0 + most / needed * s0, a * n1 + most / needed * s1, a * n2 + most / needed * s2
            contacts.mode[i] = SLIDES
            contacts.v_target[i, 0], contacts.v_target[i, 1], contacts.v_target[i, 2] = g0, g1, g2
            changes += 1
    return changes


@njit_inlined
def onto_edge(contacts, i, a, b, edge):
    """Node i moves along `edge` alone: v_target = alpha n + beta m with n·v_target = a and m·v_target = b."""
    n0, n1, n2 = contacts.normal[i, 0], contacts.normal[i, 1], contacts.normal[i, 2]
    m0, m1, m2 = contacts.second_normal[i, 0], contacts.second_normal[i, 1], contacts.second_normal[i, 2]
    e0, e1, e2 = edge
    square = e0 * e0 + e1 * e1 + e2 * e2
    cosine, root = n0 * m0 + n1 * m1 + n2 * m2, math.sqrt(square)
    alpha, beta = (a - cosine * b) / square, (b - cosine * a) / square
    contacts.direction[i, 0], contacts.direction[i, 1], contacts.direction[i, 2] = e0 / root, e1 / root, e2 / root
    contacts.v_target[i, 0] = alpha * n0 + beta * m0
    contacts.v_target[i, 1] = alpha * n1 + beta * m1
    contacts.v_target[i, 2] = alpha * n2 + beta * m2


@njit_lean
def activate_edges(model, nodes, contacts, boundary, step, push):
    """Puts touched nodes that would enter a second obstacle on the edge e = n × n' of both (eq. 9.2); returns how many.

    Obstacles that face each other have no edge: the deeper one wins, and the other's penetration is recorded.
    """
    changes = 0
    dt = boundary.dt
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if contacts.mode[i] != SLIDES:
            continue
        n0, n1, n2 = contacts.normal[i, 0], contacts.normal[i, 1], contacts.normal[i, 2]
        u0, u1, u2 = pushed_velocity(model, nodes, boundary, push, i)
        u0, u1, u2 = allowed_part(SLIDES, n0, n1, n2, u0, u1, u2)
        u0, u1, u2 = u0 + contacts.v_target[i, 0], u1 + contacts.v_target[i, 1], u2 + contacts.v_target[i, 2]
        y0, y1, y2 = nodes.x[i, 0] + dt * u0, nodes.x[i, 1] + dt * u1, nodes.x[i, 2] + dt * u2
        deepest = 0.0
        for o in range(boundary.radius.shape[0]):
            if o + 1 == contacts.contact_id[i]:
                continue
            p0, p1, p2 = boundary.position[step, o, 0], boundary.position[step, o, 1], boundary.position[step, o, 2]
            gap, m0, m1, m2 = gap_and_normal(boundary, o, y0 - p0, y1 - p1, y2 - p2)
            e0, e1, e2 = n1 * m2 - n2 * m1, n2 * m0 - n0 * m2, n0 * m1 - n1 * m0
            square = e0 * e0 + e1 * e1 + e2 * e2
            if gap < deepest and square > PARALLEL:
                deepest = gap
                a, b = n0 * u0 + n1 * u1 + n2 * u2, m0 * u0 + m1 * u1 + m2 * u2 - gap / dt
                contacts.second[i] = o + 1
                contacts.second_normal[i, 0], contacts.second_normal[i, 1], contacts.second_normal[i, 2] = m0, m1, m2
                onto_edge(contacts, i, a, b, (e0, e1, e2))
        if deepest < 0.0:
            contacts.mode[i] = ON_EDGE
            changes += 1
    return changes


@njit_inlined
def dot(a, b):
    """a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit_lean
def impulse_shares(k, n, m):
    """The parts of k = α n + β n' + rest along two normals that are not parallel, tuples of three numbers: (α, β)."""
    along, other, cosine = dot(k, n), dot(k, m), dot(n, m)
    square = 1.0 - cosine * cosine
    return (along - cosine * other) / square, (other - cosine * along) / square


@njit_lean
def release_edges(model, nodes, contacts, boundary, push):
    """Releases nodes on an edge that one of the two obstacles would pull; the next search finds the other obstacle (eq.
    9.2)."""
    changes = 0
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if contacts.mode[i] != ON_EDGE:
            continue
        u0, u1, u2 = pushed_velocity(model, nodes, boundary, push, i)
        # The free direction along the edge is orthogonal to both normals and does not contribute.
        n = contacts.normal[i, 0], contacts.normal[i, 1], contacts.normal[i, 2]
        m = contacts.second_normal[i, 0], contacts.second_normal[i, 1], contacts.second_normal[i, 2]
        alpha, beta = impulse_shares(
            (contacts.v_target[i, 0] - u0, contacts.v_target[i, 1] - u1, contacts.v_target[i, 2] - u2), n, m
        )
        if alpha < 0.0 or beta < 0.0:
            contacts.contact_id[i], contacts.mode[i], contacts.predicted_gap[i] = 0, FREE, 0.0
            changes += 1
    return changes
