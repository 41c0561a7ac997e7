"""Springs, volume gradient and prediction of all nodes: one pass over their neighbours, 64 nodes at a time.

Each spring is computed at both of its ends, so that no result is scattered and all lanes of a vector register do the
same work.
"""

from massspring.kernels.forces.springs import SHORTEST, add_membrane_forces
from massspring.kernels.fused.chunk import AREA, FORCE, HERE, LANES, RESULT, SHARE, SPEED, SUMS, put_slice, take, total
from massspring.kernels.jit.decorators import njit_inlined, njit_lean
from massspring.kernels.jit.vec3 import cross, dot, minus, plus, times
from massspring.kernels.jit.vectors import at_least, gather, lanes_of, load, root, save, spread


@njit_inlined
def gather_slice(padded, slices, s, keeps, shortest, o, tile):
    """f_i [N] (eq. 1.1) and, where a volume is kept, 6 G_i = Σ_k d_k × d_k+1 [m²] (eq. 2.4) of a slice; its share of V.

    Its share is the slice's contribution to 18 V = Σ 6 G·(x − o); o is a node of the surface, so that no digits are
    lost far from the origin.
    """
    first, last = slices.start[s], slices.start[s + 1]
    ring_end = first + (slices.rings[s] if keeps else 0)
    none = spread(0, padded)
    origin = spread(o[0], padded), spread(o[1], padded), spread(o[2], padded)
    for lane in range(0, LANES, lanes_of(padded)):
        here = gather(padded, slices.node, s, lane)
        force, area = (none, none, none), (none, none, none)
        if ring_end > first:
            force, area = walk_rings(padded, slices, first, ring_end, lane, spread(shortest, padded), here)
            save(dot(area, minus(here, origin)), tile, SHARE + lane)
        if slices.without_length:
            force = pulled_without_length(force, padded, slices, (ring_end, last), lane, here)
        else:
            for row in range(ring_end, last):
                d = minus(gather(padded, slices.neighbour, row, lane), here)
                force = pulled_by(force, slices, row, lane, spread(shortest, padded), d)
        save_three(force, tile, FORCE + lane)
        save_three(area, tile, AREA + lane)
    return total(tile, SHARE) if ring_end > first else 0.0


@njit_inlined
def walk_rings(padded, slices, first, last, lane, shortest, here):
    """f_i of the springs to the rings of some lanes, and 6 G_i.

    d_k = x_k − x_i goes round the ring of neighbours of node i. Two cross products with a common factor are combined:
    d_k−1 × (d_k − d_k−2).
    """
    none = spread(0, padded)
    start = minus(gather(padded, slices.neighbour, first, lane), here)
    force = pulled_by((none, none, none), slices, first, lane, shortest, start)
    area, even = (none, none, none), start
    for row in range(first + 1, last - 1, 2):
        odd = minus(gather(padded, slices.neighbour, row, lane), here)
        force = pulled_by(force, slices, row, lane, shortest, odd)
        after = minus(gather(padded, slices.neighbour, row + 1, lane), here)
        force = pulled_by(force, slices, row + 1, lane, shortest, after)
        area = plus(area, cross(odd, minus(after, even)))
        even = after
    if (last - first) % 2:
        return force, plus(area, cross(even, start))
    odd = minus(gather(padded, slices.neighbour, last - 1, lane), here)
    force = pulled_by(force, slices, last - 1, lane, shortest, odd)
    return force, plus(area, cross(odd, minus(start, even)))


@njit_inlined
def pulled_by(force, slices, row, lane, shortest, d):
    """f_i + (k − k L/|d|) d [N] (eq. 1.1); exactly f_i at rest length."""
    stiffness = load(slices.stiffness, slices.stiffness_row[row], lane)
    length = at_least(root(dot(d, d)), shortest)
    c = stiffness - stiffness * (load(slices.rest_length, row, lane) / length)
    return plus(force, times(c, d))


@njit_inlined
def pulled_without_length(force, padded, slices, rows, lane, here):
    """f_i + Σ k d [N] over rows of springs without length, without root or division; identical to `pulled_by` to the
    last bit."""
    for row in range(rows[0], rows[1]):
        d = minus(gather(padded, slices.neighbour, row, lane), here)
        force = plus(force, times(load(slices.stiffness, slices.stiffness_row[row], lane), d))
    return force


@njit_inlined
def save_three(vector, tile, at):
    """Stores the components in consecutive blocks of the tile."""
    save(vector[0], tile, at)
    save(vector[1], tile, at + LANES)
    save(vector[2], tile, at + 2 * LANES)


@njit_inlined
def predict_slice(nodes, slices, s, dt, keep, a, tile):
    """v* (eq. 3.1) and G of the nodes of a slice replace x and 6 G; also their contributions to G·v* and G·W·G."""
    v, node, inverse_mass = nodes.v, slices.node, slices.inverse_mass
    sixth = nodes.x.dtype.type(1.0 / 6.0)
    if slices.first[s] >= 0:
        take(v, slices.first[s], tile)
    else:
        for lane in range(LANES):
            i, at = node[s, lane], SPEED + 3 * lane
            tile[at], tile[at + 1], tile[at + 2] = v[i, 0], v[i, 1], v[i, 2]
    for lane in range(LANES):
        at, w = SPEED + 3 * lane, inverse_mass[s, lane]
        v0 = keep * tile[at] + dt * w * tile[FORCE + lane] + a[0]
        v1 = keep * tile[at + 1] + dt * w * tile[FORCE + LANES + lane] + a[1]
        v2 = keep * tile[at + 2] + dt * w * tile[FORCE + 2 * LANES + lane] + a[2]
        g0, g1 = sixth * tile[AREA + lane], sixth * tile[AREA + LANES + lane]
        g2 = sixth * tile[AREA + 2 * LANES + lane]
        tile[SUMS + lane] = g0 * v0 + g1 * v1 + g2 * v2
        tile[SUMS + LANES + lane] = w * (g0 * g0 + g1 * g1 + g2 * g2)
        tile[HERE + lane], tile[HERE + LANES + lane], tile[HERE + 2 * LANES + lane] = v0, v1, v2
        tile[AREA + lane], tile[AREA + LANES + lane], tile[AREA + 2 * LANES + lane] = g0, g1, g2


@njit_inlined
def keep_held(slices, s, force, tile):
    """Stores the spring forces on the held nodes of a slice [N], which their attachments balance."""
    for h in range(slices.held_start[s], slices.held_start[s + 1]):
        lane = slices.held_lane[h]
        i = slices.node[s, lane]
        for axis in range(3):
            force[i, axis] = tile[FORCE + axis * LANES + lane]


@njit_inlined
def pass_slices(nodes, work, boundary, slices, keeps):
    """v* and G of all slices, with their contributions to 18 V, G·v* and G·W·G in `sums`.

    For slices of pieces only f and 6 G.
    """
    real = nodes.x.dtype.type
    dt, keep = real(boundary.dt), real(1.0 - boundary.damping * boundary.dt)
    a = (
        real(boundary.dt * boundary.gravity[0]),
        real(boundary.dt * boundary.gravity[1]),
        real(boundary.dt * boundary.gravity[2]),
    )
    padded, pulled, sums, v_star, gradient = work.padded_positions, work.pulled, work.sums, nodes.v_star, nodes.gradient
    tile = work.tile
    shortest = real(SHORTEST)
    o = padded[slices.origin, 0], padded[slices.origin, 1], padded[slices.origin, 2]
    for s in range(slices.lanes.shape[0]):
        sums[s, 0] = gather_slice(padded, slices, s, keeps, shortest, o, tile)
        if s < slices.pieces:
            for entry in range(RESULT):
                pulled[s, entry] = tile[entry]
            continue
        keep_held(slices, s, nodes.force, tile)
        predict_slice(nodes, slices, s, dt, keep, a, tile)
        put_slice(tile, HERE, slices, s, v_star)
        # Empty lanes have springs of no stiffness and no ring: they add zeros.
        if keeps:
            put_slice(tile, AREA, slices, s, gradient)
            sums[s, 1], sums[s, 2] = total(tile, SUMS), total(tile, SUMS + LANES)


@njit_inlined
def predict_from_places(model, nodes, work, boundary, keeps):
    """v* of eq. 3.1 and, where a volume is kept, G of all nodes; returns V [m³], G·v* [m³/s], G·W·G [m⁴/kg].

    `padded_positions` holds the positions. Only the forces on held nodes are stored.
    """
    slices = model.slices
    walls = model.membrane.triangles.shape[0] > 0
    if walls:
        nodes.force[:] = 0
    pass_slices(nodes, work, boundary, slices, keeps)
    join_pieces(model, nodes, work, boundary, keeps)
    volume, flow, mobility = add_up(work.sums, slices.pieces)
    if walls:
        flow += add_walls(model, nodes, boundary.dt)
    return volume, flow, mobility


@njit_inlined
def add_up(sums, pieces):
    """(V, G·v*, G·W·G) from the contributions of the slices, in double precision and always in the same order."""
    volume, flow, mobility = 0.0, 0.0, 0.0
    for s in range(sums.shape[0]):
        volume += sums[s, 0]
        if s >= pieces:
            flow += sums[s, 1]
            mobility += sums[s, 2]
    return volume / 18.0, flow, mobility


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
