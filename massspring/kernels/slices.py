"""Springs, volume gradient and prediction of 64 nodes side by side: one pass over the neighbours of every node.

Each spring is computed at both of its ends: nothing is scattered, and all lanes of a vector register do the same. A
loop copies 64 neighbours into a flat tile and the next computes on the tile, which compilers turn into vector
instructions: the blocks of one array cannot overlap, and 64 nodes later a copy has left the store buffer. Arrays get a
name before the loops, because what is taken out of a tuple has its references counted each time.
"""

import math

from massspring.kernels.compiled import inlined, lean
from massspring.kernels.membrane import add_membrane_forces
from massspring.kernels.springs import SHORTEST

LANES = 64
"""Nodes side by side; with 8 or 16 the tile waits for its own stores, 32 to 128 are equally fast."""
VECTOR = 3 * LANES
FORCE, AREA, HERE, BEFORE, FIRST, THERE = (VECTOR * block for block in range(6))
"""Where blocks of a tile begin: x, y, z of all f_i, 6 G_i, x_i, d_k−1, d_0; and x_k, four numbers a lane."""
RESULT = 2 * VECTOR
SUMS, SPEED = BEFORE, THERE
"""While v* is found: the lanes' shares of G·v* and G·W·G; v, then v*, three numbers a lane."""
TILE = 5 * VECTOR + 4 * LANES


@inlined
def fetch(places, nodes, row, tile):
    """Four numbers of each of the 64 nodes of a row into `THERE`; in fours, for one move of memory each."""
    for lane in range(LANES):
        j, at = nodes[row, lane], THERE + 4 * lane
        tile[at], tile[at + 1], tile[at + 2], tile[at + 3] = places[j, 0], places[j, 1], places[j, 2], places[j, 3]


@inlined
def way(tile, lane):
    """d_k = x_k − x_i [m], and its square, to which the fourth number adds nothing but a load without a gap."""
    at = THERE + 4 * lane
    d0 = tile[at] - tile[HERE + lane]
    d1 = tile[at + 1] - tile[HERE + LANES + lane]
    d2 = tile[at + 2] - tile[HERE + 2 * LANES + lane]
    return d0, d1, d2, d0 * d0 + d1 * d1 + d2 * d2 + tile[at + 3]


@inlined
def pull(tile, lane, stiffness, rest_length, length, d0, d1, d2):
    """f_i += (k − k L/|d|) d [N] (eq. 1); exactly 0 at rest length."""
    c = stiffness - stiffness * (rest_length / length)
    tile[FORCE + lane] += c * d0
    tile[FORCE + LANES + lane] += c * d1
    tile[FORCE + 2 * LANES + lane] += c * d2


@inlined
def sweep(tile, lane, d0, d1, d2):
    """6 G_i += d_k−1 × d_k [m²] (eq. 108)."""
    p0, p1, p2 = tile[BEFORE + lane], tile[BEFORE + LANES + lane], tile[BEFORE + 2 * LANES + lane]
    tile[AREA + lane] += p1 * d2 - p2 * d1
    tile[AREA + LANES + lane] += p2 * d0 - p0 * d2
    tile[AREA + 2 * LANES + lane] += p0 * d1 - p1 * d0


@inlined
def begin(places, node, s, tile):
    """x_i of the nodes of a slice, nothing pulls yet."""
    fetch(places, node, s, tile)
    for lane in range(LANES):
        at = THERE + 4 * lane
        tile[HERE + lane], tile[HERE + LANES + lane] = tile[at], tile[at + 1]
        tile[HERE + 2 * LANES + lane] = tile[at + 2] + tile[at + 3]
    for entry in range(VECTOR):
        tile[FORCE + entry] = 0
        tile[AREA + entry] = 0
        tile[BEFORE + entry] = 0


@inlined
def close_rings(tile, o0, o1, o2):
    """d_last × d_0 ends the rings; the shares 6 G·(x − o) of 18 V into `BEFORE`."""
    for lane in range(LANES):
        sweep(tile, lane, tile[FIRST + lane], tile[FIRST + LANES + lane], tile[FIRST + 2 * LANES + lane])
        volume = tile[AREA + lane] * (tile[HERE + lane] - o0)
        volume += tile[AREA + LANES + lane] * (tile[HERE + LANES + lane] - o1)
        volume += tile[AREA + 2 * LANES + lane] * (tile[HERE + 2 * LANES + lane] - o2)
        tile[BEFORE + lane] = volume


@lean
def gather(motion, slices, first, last, keeps, tile):
    """f_i [N] (eq. 1) and, where a volume is kept, 6 G_i = Σ_k d_k × d_k+1 [m²] (eq. 108) of some slices, (S, 384).

    d_k = x_k − x_i goes round the ring of neighbours of node i, then on to its other springs. The shares of the slices
    in 18 V = Σ 6 G·(x − o) go to `sums`; o is a node of the surface, so that no digits are lost far from the origin.
    """
    places, pulled, sums = motion.places, motion.pulled, motion.sums
    node, neighbour, rest_length, stiffness = slices.node, slices.neighbour, slices.rest_length, slices.stiffness
    start, rings = slices.start, slices.rings
    shortest = places.dtype.type(SHORTEST)
    o0, o1, o2 = places[slices.origin, 0], places[slices.origin, 1], places[slices.origin, 2]
    for s in range(first, last):
        begin(places, node, s, tile)
        ring_end = start[s] + (rings[s] if keeps else 0)
        for row in range(start[s], ring_end):
            fetch(places, neighbour, row, tile)
            for lane in range(LANES):
                d0, d1, d2, square = way(tile, lane)
                length = max(math.sqrt(square), shortest)
                pull(tile, lane, stiffness[row, lane], rest_length[row, lane], length, d0, d1, d2)
                sweep(tile, lane, d0, d1, d2)
                tile[BEFORE + lane], tile[BEFORE + LANES + lane], tile[BEFORE + 2 * LANES + lane] = d0, d1, d2
            if row == start[s]:
                for entry in range(VECTOR):
                    tile[FIRST + entry] = tile[BEFORE + entry]
        if ring_end > start[s]:
            close_rings(tile, o0, o1, o2)
        if keeps:
            sums[s, 0] = total(tile, BEFORE)
        for row in range(ring_end, start[s + 1]):
            fetch(places, neighbour, row, tile)
            for lane in range(LANES):
                d0, d1, d2, square = way(tile, lane)
                length = max(math.sqrt(square), shortest)
                pull(tile, lane, stiffness[row, lane], rest_length[row, lane], length, d0, d1, d2)
        for entry in range(RESULT):
            pulled[s, entry] = tile[entry]


@inlined
def total(tile, at):
    """The sum of 64 numbers, always in the same order: eight at a time, then those eight."""
    for eight in range(8, LANES, 8):
        for lane in range(8):
            tile[at + lane] += tile[at + eight + lane]
    found = 0.0
    for lane in range(8):
        found += tile[at + lane]
    return found


@inlined
def put(tile, block, nodes, row, lanes, x):
    """x_i = the block of the tile, for the lanes in use."""
    for lane in range(LANES):
        at = THERE + 3 * lane
        tile[at], tile[at + 1] = tile[block + lane], tile[block + LANES + lane]
        tile[at + 2] = tile[block + 2 * LANES + lane]
    for lane in range(lanes):
        i, at = nodes[row, lane], THERE + 3 * lane
        x[i, 0], x[i, 1], x[i, 2] = tile[at], tile[at + 1], tile[at + 2]


@lean
def predict_slices(motion, drive, slices, first, last, keeps, tile):
    """v* (eq. 6) and G of some slices, with their shares of G·v* and of G·W·G in `sums`."""
    real = motion.x.dtype.type
    dt, keep, sixth = real(drive.dt), real(1.0 - drive.damping * drive.dt), real(1.0 / 6.0)
    a0, a1, a2 = real(drive.dt * drive.gravity[0]), real(drive.dt * drive.gravity[1]), real(drive.dt * drive.gravity[2])
    v, v_star, gradient, pulled, sums = motion.v, motion.v_star, motion.gradient, motion.pulled, motion.sums
    node, lanes, inverse_mass = slices.node, slices.lanes, slices.inverse_mass
    for s in range(first, last):
        for lane in range(LANES):
            i, at = node[s, lane], SPEED + 3 * lane
            tile[at], tile[at + 1], tile[at + 2] = v[i, 0], v[i, 1], v[i, 2]
        for entry in range(RESULT):
            tile[entry] = pulled[s, entry]
        for lane in range(LANES):
            at, w = SPEED + 3 * lane, inverse_mass[s, lane]
            v0 = keep * tile[at] + dt * w * tile[FORCE + lane] + a0
            v1 = keep * tile[at + 1] + dt * w * tile[FORCE + LANES + lane] + a1
            v2 = keep * tile[at + 2] + dt * w * tile[FORCE + 2 * LANES + lane] + a2
            g0, g1 = sixth * tile[AREA + lane], sixth * tile[AREA + LANES + lane]
            g2 = sixth * tile[AREA + 2 * LANES + lane]
            tile[SUMS + lane] = g0 * v0 + g1 * v1 + g2 * v2
            tile[SUMS + LANES + lane] = w * (g0 * g0 + g1 * g1 + g2 * g2)
            tile[HERE + lane], tile[HERE + LANES + lane], tile[HERE + 2 * LANES + lane] = v0, v1, v2
            tile[AREA + lane], tile[AREA + LANES + lane], tile[AREA + 2 * LANES + lane] = g0, g1, g2
        put(tile, HERE, node, s, lanes[s], v_star)
        # Empty lanes have springs of no stiffness and no ring: they add zeros.
        if keeps:
            put(tile, AREA, node, s, lanes[s], gradient)
            sums[s, 1], sums[s, 2] = total(tile, SUMS), total(tile, SUMS + LANES)


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
            if keeps:
                motion.gradient[i, axis] = g
            flow += g * v
            mobility += w * g * g
    last = motion.sums.shape[0] - 1
    motion.sums[last, 1], motion.sums[last, 2] = flow, mobility


@lean
def add_walls(network, motion, dt):
    """v* += dt W f of the triangle springs [m/s]; returns what that adds to G·v* [m³/s]."""
    flow = 0.0
    motion.force[:] = 0
    add_membrane_forces(motion.x, network.membrane, motion.force)
    for i in range(motion.x.shape[0]):
        push = dt * network.inverse_mass[i]
        for axis in range(3):
            motion.v_star[i, axis] += push * motion.force[i, axis]
            flow += motion.gradient[i, axis] * push * motion.force[i, axis]
    return flow


@lean
def force_on_held(network, motion):
    """Spring forces of the held nodes [N]: what their attachments take."""
    slices = network.slices
    walls = network.membrane.triangles.shape[0] > 0
    for h in range(slices.held_node.shape[0]):
        i = slices.held_node[h]
        for axis in range(3):
            force = motion.force[i, axis] if walls else 0.0
            for p in range(slices.held_start[h], slices.held_start[h + 1]):
                s, lane = slices.held_piece[p] // LANES, slices.held_piece[p] % LANES
                force += motion.pulled[s, FORCE + axis * LANES + lane]
            motion.force[i, axis] = force


@lean
def gather_and_predict(network, motion, drive, keeps):
    """v* of eq. 6 and, where a volume is kept, G of all nodes; returns V [m³], G·v* [m³/s], G·W·G [m⁴/kg].

    Of the forces only those of held nodes are written out.
    """
    slices = network.slices
    tile = motion.tile[0]
    count = slices.lanes.shape[0]
    for i in range(motion.x.shape[0]):
        motion.places[i, 0], motion.places[i, 1], motion.places[i, 2] = motion.x[i, 0], motion.x[i, 1], motion.x[i, 2]
    gather(motion, slices, 0, count, keeps, tile)
    predict_slices(motion, drive, slices, slices.pieces, count, keeps, tile)
    join_pieces(network, motion, drive, keeps)
    volume, flow, mobility = add_up(motion.sums, slices.pieces)
    if network.membrane.triangles.shape[0] > 0:
        flow += add_walls(network, motion, drive.dt)
    force_on_held(network, motion)
    return volume, flow, mobility


@lean
def add_up(sums, pieces):
    """(V, G·v*, G·W·G) from the shares of the slices, in double precision and always in the same order."""
    volume, flow, mobility = 0.0, 0.0, 0.0
    for s in range(sums.shape[0]):
        volume += sums[s, 0]
        if s >= pieces:
            flow += sums[s, 1]
            mobility += sums[s, 2]
    return volume / 18.0, flow, mobility
