"""Slopes of nodal vectors, such as positions or velocities, at the points of quadratic tetrahedra.

A vector register holds the same number of several elements. b_i are the linear shape functions of the corners. At a
point n is the value of b_i for the nearest corner, o for the other corners. F_q = Σ_i W_i ⊗ ∇b_i over three corners,
with W_i = ∂x/∂b_i − ∂x/∂b_0, so w_q J_q = det W / 24 and w_q cof F_q ∇b_i = W_j × W_k / 24: no slope at rest is needed.
"""

from massspring.kernels.jit.decorators import njit_inlined
from massspring.kernels.jit.flat import flat
from massspring.kernels.jit.vec3 import minus, plus, times
from massspring.kernels.jit.vectors import gather, lanes_of, load, save, scatter, spread
from massspring.kernels.points.arrays import BLOCK, NODES, ROWS

AT_0, AT_1, AT_2, AT_3 = (0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3)
"""For the point near each corner: that corner, and the mid-side nodes between it and the other three, in the order of
the corners."""


@njit_inlined
def blocks_of(rows):
    """How many blocks of elements there are."""
    return rows.node.shape[0] // NODES


@njit_inlined
def gather_block(rows, vector, block):
    """Copies x, y, z of `vector` (n, 4) at the nodes of a block into the tile."""
    tile = flat(rows.tile, 0, rows.tile.shape[0])
    for a in range(NODES):
        for lane in range(0, BLOCK, lanes_of(vector)):
            x, y, z = gather(vector, rows.node, NODES * block + a, lane)
            at = 3 * a * BLOCK + lane
            save(x, tile, at)
            save(y, tile, at + BLOCK)
            save(z, tile, at + 2 * BLOCK)


@njit_inlined
def scatter_block(rows, block):
    """Adds the forces in `push` to the nodes of a block. The order does not depend on the size of a register."""
    for a in range(NODES):
        for lane in range(0, BLOCK, lanes_of(rows.push)):
            scatter(load_three(rows.push, 3 * a, lane), rows.force, rows.node, NODES * block + a, lane)


@njit_inlined
def load_three(table, row, lane):
    """x, y and z from three consecutive rows."""
    return load(table, row, lane), load(table, row + 1, lane), load(table, row + 2, lane)


@njit_inlined
def open_block(rows, lane):
    """B_i = (4 o − 1)(x_i − x_0) + 4 o Σ_j (x_ij − x_0j), from the tile's vector x at corners and mid-sides: the part
    of ∂x/∂b_i − ∂x/∂b_0 common to all points (eq. 8.10a)."""
    corner, side = spread(4.0 * rows.other - 1.0, rows.tile), spread(4.0 * rows.other, rows.tile)
    x, tile = rows.tile, flat(rows.tile, 0, rows.tile.shape[0])
    for axis in range(3):
        x0, x1, x2, x3 = load(x, axis, lane), load(x, 3 + axis, lane), load(x, 6 + axis, lane), load(x, 9 + axis, lane)
        x01, x12, x02 = load(x, 12 + axis, lane), load(x, 15 + axis, lane), load(x, 18 + axis, lane)
        x03, x13, x23 = load(x, 21 + axis, lane), load(x, 24 + axis, lane), load(x, 27 + axis, lane)
        at = (ROWS + axis) * BLOCK + lane
        save(corner * (x1 - x0) + side * (x12 + x13 - x02 - x03), tile, at)
        save(corner * (x2 - x0) + side * (x12 + x23 - x01 - x03), tile, at + 3 * BLOCK)
        save(corner * (x3 - x0) + side * (x13 + x23 - x01 - x02), tile, at + 6 * BLOCK)


@njit_inlined
def slope(rows, side, near, first, lane):
    """W_i = ∂x/∂b_i − ∂x/∂b_0 = B_i + 4 (n − o)(x_iq − x_0q) at point q; `near` and `first` are the nodes iq and 0q."""
    nearer, base = spread(4.0 * (rows.own - rows.other), rows.tile), load_three(rows.tile, ROWS + 3 * side, lane)
    to, of = load_three(rows.tile, 3 * near, lane), load_three(rows.tile, 3 * first, lane)
    return plus(base, times(nearer, minus(to, of)))


@njit_inlined
def slopes(rows, between, lane):
    """W_1, W_2 and W_3 at the point whose corner has `between`, the nodes half-way to each corner."""
    first, one, two, three = between
    return slope(rows, 0, one, first, lane), slope(rows, 1, two, first, lane), slope(rows, 2, three, first, lane)


@njit_inlined
def save_three(vector, table, at):
    """Stores x, y and z in three consecutive rows."""
    save(vector[0], table, at)
    save(vector[1], table, at + BLOCK)
    save(vector[2], table, at + 2 * BLOCK)
