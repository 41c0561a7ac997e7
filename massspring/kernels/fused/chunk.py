"""64 nodes side by side: what a loop over the lanes of a tile does.

A loop copies 64 neighbours into a flat tile and the next computes on the tile, which compilers turn into vector
instructions: the blocks of one array cannot overlap, and 64 nodes later a copy has left the store buffer.
"""

import math

from massspring.kernels.jit.decorators import inlined
from massspring.kernels.jit.flat import flat

LANES = 64
"""Nodes side by side; with 8 or 16 the tile waits for its own stores, 32 to 128 are equally fast."""
VECTOR = 3 * LANES
FORCE, AREA, HERE, EVEN, ODD, FIRST, THERE = (VECTOR * block for block in range(7))
"""Where blocks of a tile begin: x, y, z of all f_i, 6 G_i, x_i, the last d_k of even and of odd k in a ring, d_0; and
x_k, four numbers a lane."""
RESULT = 2 * VECTOR
SUMS, SHARE, SPEED = EVEN, THERE, THERE
"""Shares of the lanes in G·v* and G·W·G; of 18 V; v, then v*, three numbers a lane."""
TILE = 6 * VECTOR + 4 * LANES


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
def stretch(tile, lane, stiffness, rest_length, shortest):
    """The pull of the spring to x_k; d_k = x_k − x_i [m]."""
    d0, d1, d2, square = way(tile, lane)
    pull(tile, lane, stiffness, rest_length, max(math.sqrt(square), shortest), d0, d1, d2)
    return d0, d1, d2


@inlined
def store(tile, block, lane, d0, d1, d2):
    """A vector of a lane into a block of the tile."""
    tile[block + lane], tile[block + LANES + lane], tile[block + 2 * LANES + lane] = d0, d1, d2


@inlined
def sweep(tile, block, lane, d0, d1, d2):
    """6 G_i += p × d [m²], p in a block of the tile."""
    p0, p1, p2 = tile[block + lane], tile[block + LANES + lane], tile[block + 2 * LANES + lane]
    tile[AREA + lane] += p1 * d2 - p2 * d1
    tile[AREA + LANES + lane] += p2 * d0 - p0 * d2
    tile[AREA + 2 * LANES + lane] += p0 * d1 - p1 * d0


@inlined
def sweep_pair(tile, lane, d0, d1, d2):
    """6 G_i += d_k−1 × (d_k − d_k−2) (eq. 108): two products of a ring for the price of one."""
    e0, e1, e2 = tile[EVEN + lane], tile[EVEN + LANES + lane], tile[EVEN + 2 * LANES + lane]
    sweep(tile, ODD, lane, d0 - e0, d1 - e1, d2 - e2)


@inlined
def take(x, first, width, tile):
    """The rows of 64 nodes that follow each other in memory, `width` numbers each, into `THERE`."""
    rows = flat(x, first, first + LANES)
    for k in range(width * LANES):
        tile[THERE + k] = rows[k]


@inlined
def begin(places, slices, s, tile):
    """x_i of the nodes of a slice, nothing pulls yet."""
    if slices.first[s] >= 0:
        take(places, slices.first[s], 4, tile)
    else:
        fetch(places, slices.node, s, tile)
    for lane in range(LANES):
        at = THERE + 4 * lane
        tile[HERE + lane], tile[HERE + LANES + lane] = tile[at], tile[at + 1]
        tile[HERE + 2 * LANES + lane] = tile[at + 2] + tile[at + 3]
    for entry in range(VECTOR):
        tile[FORCE + entry] = 0
        tile[AREA + entry] = 0


@inlined
def close_rings(tile, odd, o0, o1, o2):
    """What d_last and d_0 add ends the rings; the shares 6 G·(x − o) of 18 V into `SHARE`."""
    if odd:
        for lane in range(LANES):
            sweep(tile, EVEN, lane, tile[FIRST + lane], tile[FIRST + LANES + lane], tile[FIRST + 2 * LANES + lane])
            weigh(tile, lane, o0, o1, o2)
    else:
        for lane in range(LANES):
            sweep_pair(tile, lane, tile[FIRST + lane], tile[FIRST + LANES + lane], tile[FIRST + 2 * LANES + lane])
            weigh(tile, lane, o0, o1, o2)


@inlined
def weigh(tile, lane, o0, o1, o2):
    """6 G·(x − o) [m³] into `SHARE`."""
    volume = tile[AREA + lane] * (tile[HERE + lane] - o0)
    volume += tile[AREA + LANES + lane] * (tile[HERE + LANES + lane] - o1)
    volume += tile[AREA + 2 * LANES + lane] * (tile[HERE + 2 * LANES + lane] - o2)
    tile[SHARE + lane] = volume


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
def put(tile, block, slices, s, x):
    """x_i = the block of the tile, for the lanes in use."""
    for lane in range(LANES):
        at = THERE + 3 * lane
        tile[at], tile[at + 1] = tile[block + lane], tile[block + LANES + lane]
        tile[at + 2] = tile[block + 2 * LANES + lane]
    first, node = slices.first[s], slices.node
    if first >= 0:
        rows = flat(x, first, first + LANES)
        for k in range(VECTOR):
            rows[k] = tile[THERE + k]
        return
    for lane in range(slices.lanes[s]):
        i, at = node[s, lane], THERE + 3 * lane
        x[i, 0], x[i, 1], x[i, 2] = tile[at], tile[at + 1], tile[at + 2]
