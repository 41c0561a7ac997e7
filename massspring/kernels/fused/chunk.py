"""The tile: scratch memory of a pass over 64 nodes, with functions that fill it and copy it to the nodes."""

from massspring.kernels.jit.decorators import njit_inlined
from massspring.kernels.jit.flat import flat

LANES = 64
"""Nodes per slice."""
VECTOR = 3 * LANES
FORCE, AREA, HERE, SUMS, THERE = (VECTOR * block for block in range(5))
"""First index of the blocks of a tile: x, y, z of all f_i, of 6 G_i, of v*; contributions of the lanes to G·v* and
G·W·G; numbers read and written node by node."""
RESULT = 2 * VECTOR
SHARE, SPEED = THERE, THERE
"""Contributions of the lanes to 18 V; v, then v*, three numbers per lane."""
TILE = 5 * VECTOR


@njit_inlined
def take(x, first, tile):
    """Copies the rows of 64 nodes with consecutive numbers into `THERE`."""
    rows = flat(x, first, first + LANES)
    for k in range(VECTOR):
        tile[THERE + k] = rows[k]


@njit_inlined
def total(tile, at):
    """The sum of 64 numbers, always in the same order: eight at a time, then those eight."""
    for eight in range(8, LANES, 8):
        for lane in range(8):
            tile[at + lane] += tile[at + eight + lane]
    amount = 0.0
    for lane in range(8):
        amount += tile[at + lane]
    return amount


@njit_inlined
def put_slice(tile, block, slices, s, x):
    """Copies a block of the tile to x_i of the nodes, for the lanes in use."""
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


@njit_inlined
def pad_positions(nodes, work, first, last):
    """Copies the positions of nodes first ≤ i < last to `padded_positions`, (n, 4), so that one load fetches a node."""
    x, padded = flat(nodes.x, first, last), flat(work.padded_positions, first, last)
    zero = nodes.x.dtype.type(0)
    for i in range(last - first):
        padded[4 * i], padded[4 * i + 1] = x[3 * i], x[3 * i + 1]
        padded[4 * i + 2], padded[4 * i + 3] = x[3 * i + 2], zero
