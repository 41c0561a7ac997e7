"""What the pass over slices leaves to do: nodes whose neighbours fill several lanes, and triangle springs."""

from massspring.kernels.forces.membrane import add_membrane_forces
from massspring.kernels.fused.chunk import AREA, FORCE, LANES
from massspring.kernels.jit.decorators import lean


@lean
def join_pieces(network, motion, drive, keeps):
    """v* and G of the nodes in pieces, and their shares of G·v* and G·W·G in the last of `sums`."""
    slices = network.slices
    keep = 1.0 - drive.damping * drive.dt
    flow, mobility = 0.0, 0.0
    for k in range(slices.split_node.shape[0]):
        i = slices.split_node[k]
        w = network.inverse_mass[i]
        for axis in range(3):
            force, area = 0.0, 0.0
            for p in range(slices.split_start[k], slices.split_start[k + 1]):
                s, lane = slices.split_piece[p] // LANES, slices.split_piece[p] % LANES
                force += motion.pulled[s, FORCE + axis * LANES + lane]
                area += motion.pulled[s, AREA + axis * LANES + lane]
            g = area / 6.0
            v = keep * motion.v[i, axis] + drive.dt * (w * force + drive.gravity[axis])
            motion.v_star[i, axis] = v
            if w == 0.0:
                motion.force[i, axis] = force
            if keeps:
                motion.gradient[i, axis] = g
            flow += g * v
            mobility += w * g * g
    last = motion.sums.shape[0] - 1
    motion.sums[last, 1], motion.sums[last, 2] = flow, mobility


@lean
def add_walls(network, motion, dt):
    """v* += dt W f of the triangle springs [m/s]; returns what that adds to G·v* [m³/s].

    `motion.force` comes with the spring forces of held nodes alone, whose W is 0: theirs are added to.
    """
    flow = 0.0
    add_membrane_forces(motion.x, network.membrane, motion.force)
    for i in range(motion.x.shape[0]):
        push = dt * network.inverse_mass[i]
        for axis in range(3):
            motion.v_star[i, axis] += push * motion.force[i, axis]
            flow += motion.gradient[i, axis] * push * motion.force[i, axis]
    return flow
