"""Velocities of touched nodes after contact, and the impulses of the obstacles."""

from massspring.kernels.contact.friction import impulse_shares
from massspring.kernels.contact.modes import FREE, ON_EDGE
from massspring.kernels.contact.node_contact import allowed_part
from massspring.kernels.jit.decorators import njit_inlined, njit_lean


@njit_lean
def book(contact_impulse, o, other, k0, k1, k2):
    """Moves an impulse [N s] from obstacle o to `other`, since both obstacles of an edge push."""
    contact_impulse[o, 0] -= k0
    contact_impulse[o, 1] -= k1
    contact_impulse[o, 2] -= k2
    contact_impulse[other, 0] += k0
    contact_impulse[other, 1] += k1
    contact_impulse[other, 2] += k2


@njit_inlined
def settled(contacts, i, u0, u1, u2):
    """Velocity of a touched node after contact [m/s], P u + v_target (eq. 3.5)."""
    d0, d1, d2 = contacts.direction[i, 0], contacts.direction[i, 1], contacts.direction[i, 2]
    p0, p1, p2 = allowed_part(contacts.mode[i], d0, d1, d2, u0, u1, u2)
    return p0 + contacts.v_target[i, 0], p1 + contacts.v_target[i, 1], p2 + contacts.v_target[i, 2]


@njit_inlined
def book_contacts(model, nodes, contacts, push, dt, contact_impulse):
    """Adds the impulse of each obstacle, m (v⁺ − u) [N s] (eq. 3.5); u is the velocity without contact."""
    v_star, direction, mode = nodes.v_star, push.direction, contacts.mode
    real = nodes.x.dtype.type
    impulse = real(dt * push.factor)
    for k in range(contacts.active_count[0]):
        i = contacts.active[k]
        if mode[i] == FREE:
            continue
        w = impulse * real(model.inverse_mass[i])
        u0, u1 = v_star[i, 0] + w * direction[i, 0], v_star[i, 1] + w * direction[i, 1]
        u2 = v_star[i, 2] + w * direction[i, 2]
        w0, w1, w2 = settled(contacts, i, u0, u1, u2)
        o, m = contacts.contact_id[i] - 1, model.mass[i]
        k0, k1, k2 = m * (w0 - u0), m * (w1 - u1), m * (w2 - u2)
        contact_impulse[o, 0] += k0
        contact_impulse[o, 1] += k1
        contact_impulse[o, 2] += k2
        if mode[i] == ON_EDGE:
            m0, m1, m2 = contacts.second_normal[i, 0], contacts.second_normal[i, 1], contacts.second_normal[i, 2]
            n0, n1, n2 = contacts.normal[i, 0], contacts.normal[i, 1], contacts.normal[i, 2]
            _, beta = impulse_shares((k0, k1, k2), (n0, n1, n2), (m0, m1, m2))
            book(contact_impulse, o, contacts.second[i] - 1, beta * m0, beta * m1, beta * m2)
