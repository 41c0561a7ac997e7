"""Forces other than those of springs."""

from massspring.kernels.jit.decorators import compiled
from massspring.kernels.jit.vec3 import add_to, row, times


@compiled
def add_to_prediction(model, nodes, force, dt):
    """v* += dt W f [m/s] for one more force [N], (n, 3), which is also added to the force on held nodes (eq. 3.1,
    3.6)."""
    for i in range(force.shape[0]):
        add_to(nodes.v_star, i, times(dt * model.inverse_mass[i], row(force, i)))
    for h in range(model.held_nodes.shape[0]):
        i = model.held_nodes[h]
        add_to(nodes.force, i, row(force, i))
