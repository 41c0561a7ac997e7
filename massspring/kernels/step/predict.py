"""Everything of a step that is known before it, for methods that do not write it out themselves."""

from massspring.kernels.contact.node_contact import allowed_part
from massspring.kernels.fused.sweep import gather_and_predict
from massspring.kernels.jit.decorators import compiled
from massspring.kernels.step.advance import prescribe_velocity_into


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


@compiled
def unpushed_into(motion, dt, y):
    """y = x + dt ṽ [m], (n, 3): where the step ends without pressure, contact included (eq. 9, 10)."""
    for i in range(y.shape[0]):
        u0, u1, u2 = motion.v_star[i, 0], motion.v_star[i, 1], motion.v_star[i, 2]
        if motion.locked[i] > 0:
            e0, e1, e2 = motion.direction[i, 0], motion.direction[i, 1], motion.direction[i, 2]
            u0, u1, u2 = allowed_part(motion.locked[i], e0, e1, e2, u0, u1, u2)
            u0, u1, u2 = u0 + motion.goal[i, 0], u1 + motion.goal[i, 1], u2 + motion.goal[i, 2]
        y[i, 0] = motion.x[i, 0] + dt * u0
        y[i, 1] = motion.x[i, 1] + dt * u1
        y[i, 2] = motion.x[i, 2] + dt * u2


@compiled
def pushed_by_into(motion, inverse_mass, factor, force, d):
    """d = factor · W̃ F, (n, 3): what a force on every node moves, where contact and held nodes let it (eq. 9)."""
    for i in range(d.shape[0]):
        push = factor * inverse_mass[i]
        d0, d1, d2 = push * force[i, 0], push * force[i, 1], push * force[i, 2]
        if motion.locked[i] > 0:
            e0, e1, e2 = motion.direction[i, 0], motion.direction[i, 1], motion.direction[i, 2]
            d0, d1, d2 = allowed_part(motion.locked[i], e0, e1, e2, d0, d1, d2)
        d[i, 0], d[i, 1], d[i, 2] = d0, d1, d2
