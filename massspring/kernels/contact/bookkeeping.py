"""Velocities of touched nodes after contact, and the impulses of the obstacles."""

from massspring.kernels.contact.constrained_motion import settled
from massspring.kernels.contact.friction import impulse_shares
from massspring.kernels.contact.modes import FREE, ON_EDGE
from massspring.kernels.jit.decorators import njit_inlined
from massspring.kernels.jit.vec3 import add_to, minus, plus, row, take_from, times


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
