"""Motion that contact allows: without pressure, and by a force."""

from massspring.kernels.contact.modes import FREE
from massspring.kernels.contact.node_contact import allowed_part
from massspring.kernels.jit.decorators import compiled


@compiled
def unpushed_into(nodes, contacts, dt, y):
    """y = x + dt ṽ [m], (n, 3): where the step ends without pressure, contact included (eq. 3.4, 3.5)."""
    for i in range(y.shape[0]):
        u0, u1, u2 = nodes.v_star[i, 0], nodes.v_star[i, 1], nodes.v_star[i, 2]
        if contacts.mode[i] > FREE:
            e0, e1, e2 = contacts.direction[i, 0], contacts.direction[i, 1], contacts.direction[i, 2]
            u0, u1, u2 = allowed_part(contacts.mode[i], e0, e1, e2, u0, u1, u2)
            u0, u1, u2 = u0 + contacts.v_target[i, 0], u1 + contacts.v_target[i, 1], u2 + contacts.v_target[i, 2]
        y[i, 0] = nodes.x[i, 0] + dt * u0
        y[i, 1] = nodes.x[i, 1] + dt * u1
        y[i, 2] = nodes.x[i, 2] + dt * u2


@compiled
def pushed_by_into(contacts, inverse_mass, factor, force, d):
    """d = factor · W̃ F, (n, 3): displacement by a force on every node, with contact and held nodes (eq. 3.4)."""
    for i in range(d.shape[0]):
        push = factor * inverse_mass[i]
        d0, d1, d2 = push * force[i, 0], push * force[i, 1], push * force[i, 2]
        if contacts.mode[i] > FREE:
            e0, e1, e2 = contacts.direction[i, 0], contacts.direction[i, 1], contacts.direction[i, 2]
            d0, d1, d2 = allowed_part(contacts.mode[i], e0, e1, e2, d0, d1, d2)
        d[i, 0], d[i, 1], d[i, 2] = d0, d1, d2
