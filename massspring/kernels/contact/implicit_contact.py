"""Contact for methods whose steps are long and solved as a whole."""

from massspring.kernels.contact.active_set import activate, enters, forget_released, register
from massspring.kernels.contact.modes import FREE
from massspring.kernels.jit.decorators import compiled


@compiled
def activate_entering(model, nodes, contacts, boundary, step, push):
    """Puts free surface nodes that would enter an obstacle onto it (eq. 3.7) and lists them; how many.

    Those that have been released since the last search leave the list.
    """
    forget_released(contacts)
    count = 0
    for c in range(model.surface_nodes.shape[0]):
        i = model.surface_nodes[c]
        if model.inverse_mass[i] == 0.0 or contacts.mode[i] > FREE:
            continue
        if enters(model, nodes, boundary, step, push, i):
            contacts.entering[count] = i
            count += 1
    if count > 0:
        activate(model, nodes, contacts, boundary, step, push, count)
        register(contacts, count)
    return count
