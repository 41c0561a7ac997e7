"""The residual with which a pass of the implicit springs starts."""

from massspring.kernels.constraint.jacobian import rows_into, transposed_rows_times_into
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
