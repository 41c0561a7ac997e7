"""Motion that contact allows: without pressure, and by a force."""

from massspring.kernels.contact.modes import FREE
from massspring.kernels.contact.node_contact import allowed_part
from massspring.kernels.jit.decorators import compiled, njit_inlined
from massspring.kernels.jit.vec3 import plus, put, row, times


@compiled
def unpushed_into(nodes, contacts, dt, y):
    """y = x + dt ṽ [m], (n, 3): where the step ends without pressure, contact included (eq. 3.4, 3.5)."""
    for i in range(y.shape[0]):
        put(y, i, plus(row(nodes.x, i), times(dt, after_contact(contacts, i, row(nodes.v_star, i)))))


@compiled
def pushed_by_into(contacts, inverse_mass, factor, force, d):
    """d = factor · W̃ F, (n, 3): displacement by a force on every node, with contact and held nodes (eq. 3.4)."""
    for i in range(d.shape[0]):
        put(d, i, allowed(contacts, i, times(factor * inverse_mass[i], row(force, i))))


@njit_inlined
def allowed(contacts, i, g):
    """The part of a vector that obstacles leave to node i (eq. 3.4)."""
    if contacts.mode[i] > FREE:
        return allowed_part(contacts.mode[i], row(contacts.direction, i), g)
    return g


@njit_inlined
def settled(contacts, i, u):
    """Velocity of a touched node after contact [m/s], P u + v_target (eq. 3.5)."""
    return plus(allowed_part(contacts.mode[i], row(contacts.direction, i), u), row(contacts.v_target, i))


@njit_inlined
def after_contact(contacts, i, u):
    """Velocity of any node after contact [m/s]: u of a free one (eq. 3.5)."""
    if contacts.mode[i] > FREE:
        return settled(contacts, i, u)
    return u


@njit_inlined
def moved_by(contacts, inverse_mass, i, g):
    """W̃ g at node i (eq. 3.4)."""
    return allowed(contacts, i, times(inverse_mass[i], g))
