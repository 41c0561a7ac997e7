"""Everything of a step that is known before it: what all methods but the two fastest begin with."""

from massspring.kernels.compiled import compiled
from massspring.kernels.membrane import add_membrane_forces
from massspring.kernels.motion import predict_velocity_into, prescribe_velocity_into
from massspring.kernels.springs import spring_forces_into


@compiled
def predict(network, motion, drive, step):
    """v* of the forces at x, of damping and gravity [m/s], and of held nodes (eq. 1, 6, 7), before contact."""
    dt = drive.dt
    spring_forces_into(motion.x, network.ends, network.rest_length, network.stiffness, motion.force)
    add_membrane_forces(motion.x, network.membrane, motion.force)
    predict_velocity_into(motion.v, motion.force, network.inverse_mass, dt, drive.damping, drive.gravity, motion.v_star)
    held = drive.held_displacement[step]
    prescribe_velocity_into(
        motion.x, network.held_nodes, network.held_group, network.held_rest, held, dt, motion.v_star
    )
