"""Forces other than those of springs."""

from massspring.kernels.jit.decorators import compiled


@compiled
def add_to_prediction(model, nodes, force, dt):
    """v* += dt W f [m/s] for one more force [N], (n, 3), which is also added to the force on held nodes (eq. 3.1,
    3.6)."""
    for i in range(force.shape[0]):
        push = dt * model.inverse_mass[i]
        nodes.v_star[i, 0] += push * force[i, 0]
        nodes.v_star[i, 1] += push * force[i, 1]
        nodes.v_star[i, 2] += push * force[i, 2]
    for h in range(model.held_nodes.shape[0]):
        i = model.held_nodes[h]
        nodes.force[i, 0] += force[i, 0]
        nodes.force[i, 1] += force[i, 1]
        nodes.force[i, 2] += force[i, 2]
