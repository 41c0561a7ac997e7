"""What a pass of the implicit springs starts from: the residual, and the nodes that would enter an obstacle."""

from massspring.kernels.constraint.jacobian import rows_into, transposed_rows_times_into
from massspring.kernels.contact.active_set import activate, enters, forget_released, register
from massspring.kernels.contact.node_contact import FREE
from massspring.kernels.forces.springs import spring_forces_into
from massspring.kernels.jit.decorators import compiled


@compiled
def imbalance_into(model, nodes, rows, p, boundary, out):
    """dt M v + dt² (f(p) + Jᵀ lam + m g) − (1 + c dt) M (p − x) [kg m], (n, 3) (eq. 12.2); J, V at p go to `rows`."""
    dt = boundary.dt
    spring_forces_into(p, model.ends, model.rest_length, model.stiffness, nodes.force)
    rows_into(p, model.inverse_mass, rows)
    transposed_rows_times_into(rows, rows.lam, out)
    for i in range(p.shape[0]):
        m = model.mass[i]
        for axis in range(3):
            load = dt * dt * (nodes.force[i, axis] + out[i, axis] + m * boundary.gravity[axis])
            moved = (1.0 + boundary.damping * dt) * (p[i, axis] - nodes.x[i, axis])
            out[i, axis] = m * (dt * nodes.v[i, axis] - moved) + load


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
