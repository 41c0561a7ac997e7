"""Everything of a step that is known before it, for methods that do not write it out themselves."""

from massspring.kernels.fused.sweep import gather_and_predict
from massspring.kernels.jit.decorators import compiled
from massspring.kernels.step.attachments import prescribe_velocity_into


@compiled
def predict(network, motion, drive, step, keeps):
    """v* of springs, damping, gravity and held nodes (eq. 1, 6, 7) and, where a volume is kept, G.

    Returns V [m³] and G·W·G [m⁴/kg].
    """
    volume, _, mobility = gather_and_predict(network, motion, drive, keeps)
    held = drive.held_displacement[step]
    prescribe_velocity_into(
        motion.x, network.held_nodes, network.held_group, network.held_rest, held, drive.dt, motion.v_star
    )
    return volume, mobility


@compiled
def add_to_prediction(network, motion, force, dt):
    """v* += dt W f [m/s] for one more force [N], (n, 3), booked at held nodes too (eq. 6, 11)."""
    for i in range(force.shape[0]):
        push = dt * network.inverse_mass[i]
        motion.v_star[i, 0] += push * force[i, 0]
        motion.v_star[i, 1] += push * force[i, 1]
        motion.v_star[i, 2] += push * force[i, 2]
    for h in range(network.held_nodes.shape[0]):
        i = network.held_nodes[h]
        motion.force[i, 0] += force[i, 0]
        motion.force[i, 1] += force[i, 1]
        motion.force[i, 2] += force[i, 2]
