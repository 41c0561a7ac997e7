"""Contact for methods whose steps are long and solved as a whole."""

from massspring.kernels.compiled import compiled
from massspring.kernels.contact import seat
from massspring.kernels.distances import round_gap


@compiled
def seat_entering(network, motion, drive, step):
    """Puts free surface nodes that `v_star` carries into an obstacle onto it (eq. 12); how many."""
    count = 0
    for c in range(network.surface_nodes.shape[0]):
        i = network.surface_nodes[c]
        if network.inverse_mass[i] == 0.0 or motion.locked[i] > 0:
            continue
        for o in range(drive.radius.shape[0]):
            r0 = motion.x[i, 0] + drive.dt * motion.v_star[i, 0] - drive.position[step, o, 0]
            r1 = motion.x[i, 1] + drive.dt * motion.v_star[i, 1] - drive.position[step, o, 1]
            r2 = motion.x[i, 2] + drive.dt * motion.v_star[i, 2] - drive.position[step, o, 2]
            if drive.is_plane[o]:
                n0, n1, n2 = drive.plane_normal[o, 0], drive.plane_normal[o, 1], drive.plane_normal[o, 2]
                gap = n0 * r0 + n1 * r1 + n2 * r2
            else:
                a0, a1, a2 = drive.span[o, 0], drive.span[o, 1], drive.span[o, 2]
                gap = round_gap(r0, r1, r2, a0, a1, a2, drive.radius[o])
            if gap < 0.0:
                motion.entering[count] = i
                count += 1
                break
    if count > 0:
        seat(network, motion, drive, step, 0.0, count)
    return count
