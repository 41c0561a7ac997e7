"""Work left after the pass over slices: nodes whose neighbours fill several lanes, and triangle springs."""

from massspring.kernels.forces.membrane import add_membrane_forces
from massspring.kernels.fused.chunk import AREA, FORCE, LANES
from massspring.kernels.jit.decorators import njit_lean


@njit_lean
def join_pieces(model, nodes, work, boundary, keeps):
    """v* and G of the nodes in pieces; their contributions to G·v* and G·W·G go into the last row of `sums`."""
    slices = model.slices
    keep = 1.0 - boundary.damping * boundary.dt
    flow, mobility = 0.0, 0.0
    for k in range(slices.split_node.shape[0]):
        i = slices.split_node[k]
        w = model.inverse_mass[i]
        for axis in range(3):
            force, area = 0.0, 0.0
            for p in range(slices.split_start[k], slices.split_start[k + 1]):
                s, lane = slices.split_piece[p] // LANES, slices.split_piece[p] % LANES
                force += work.pulled[s, FORCE + axis * LANES + lane]
                area += work.pulled[s, AREA + axis * LANES + lane]
            g = area / 6.0
            v = keep * nodes.v[i, axis] + boundary.dt * (w * force + boundary.gravity[axis])
            nodes.v_star[i, axis] = v
            if w == 0.0:
                nodes.force[i, axis] = force
            if keeps:
                nodes.gradient[i, axis] = g
            flow += g * v
            mobility += w * g * g
    last = work.sums.shape[0] - 1
    work.sums[last, 1], work.sums[last, 2] = flow, mobility


@njit_lean
def add_walls(model, nodes, dt):
    """v* += dt W f of the triangle springs [m/s]; returns what that adds to G·v* [m³/s].

    On entry `nodes.force` holds the spring forces of held nodes, whose W is 0, and zeros elsewhere; the forces are
    added to it.
    """
    flow = 0.0
    add_membrane_forces(nodes.x, model.membrane, nodes.force)
    for i in range(nodes.x.shape[0]):
        push = dt * model.inverse_mass[i]
        for axis in range(3):
            nodes.v_star[i, axis] += push * nodes.force[i, axis]
            flow += nodes.gradient[i, axis] * push * nodes.force[i, axis]
    return flow
