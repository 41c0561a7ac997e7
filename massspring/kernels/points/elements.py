"""Sums over the points of quadratic tetrahedra: volumes, their gradients, and products with both.

A vector register holds the same number of several elements.
"""

from massspring.kernels.forces.volume import volume_gradient_into
from massspring.kernels.fused.sweep import cross, dot
from massspring.kernels.jit.decorators import njit_inlined, njit_lean
from massspring.kernels.jit.flat import flat
from massspring.kernels.jit.vectors import gather, lanes_of, load, save, spread
from massspring.kernels.points.arrays import BLOCK, CORNERS, NODES, POINTS, ROWS


@njit_inlined
def blocks_of(rows):
    """How many blocks of elements there are."""
    return rows.node.shape[0] // NODES


@njit_inlined
def gather_block(rows, vector, block):
    """What `vector` (n, 4) is at the nodes of a block, x, y, z of each, into the tile."""
    tile = flat(rows.tile, 0, rows.tile.shape[0])
    for a in range(NODES):
        for lane in range(0, BLOCK, lanes_of(vector)):
            x, y, z = gather(vector, rows.node, NODES * block + a, lane)
            at = 3 * a * BLOCK + lane
            save(x, tile, at)
            save(y, tile, at + BLOCK)
            save(z, tile, at + 2 * BLOCK)


@njit_inlined
def load_three(table, row, lane):
    """x, y and z from rows that follow each other."""
    return load(table, row, lane), load(table, row + 1, lane), load(table, row + 2, lane)


@njit_inlined
def plus_scaled(sums, vector, factor):
    return sums[0] + vector[0] * factor, sums[1] + vector[1] * factor, sums[2] + vector[2] * factor


@njit_inlined
def times(vector, factor):
    return vector[0] * factor, vector[1] * factor, vector[2] * factor


@njit_inlined
def open_point(rows, block, q, lane):
    """F_q of the positions in the tile, D_qa = w_q cof F_q ∇N_a of all nodes into `area`, −b (J_q − 1) into `stretch`,
    w_q J_q into the tile."""
    none, point = spread(0, rows.weight), block * POINTS + q
    first = ROWS * point
    f1, f2, f3 = (none, none, none), (none, none, none), (none, none, none)
    for a in range(NODES):
        x, g = load_three(rows.tile, 3 * a, lane), load_three(rows.gradient, first + 3 * a, lane)
        f1, f2, f3 = plus_scaled(f1, x, g[0]), plus_scaled(f2, x, g[1]), plus_scaled(f3, x, g[2])
    c1, c2, c3 = cross(f2, f3), cross(f3, f1), cross(f1, f2)
    weight, ratio = load(rows.weight, point, lane), dot(f1, c1)
    stretch, tile = flat(rows.stretch, point, point + 1), flat(rows.tile, ROWS + q, ROWS + q + 1)
    save(spread(-rows.bulk, rows.weight) * (ratio - spread(1, rows.weight)), stretch, lane)
    save(weight * ratio, tile, lane)
    c1, c2, c3 = times(c1, weight), times(c2, weight), times(c3, weight)
    area = flat(rows.area, first, first + ROWS)
    for a in range(NODES):
        g, at = load_three(rows.gradient, first + 3 * a, lane), 3 * a * BLOCK + lane
        d = plus_scaled(plus_scaled(times(c1, g[0]), c2, g[1]), c3, g[2])
        save(d[0], area, at)
        save(d[1], area, at + BLOCK)
        save(d[2], area, at + 2 * BLOCK)


@njit_inlined
def share_among_corners(rows, block, lane):
    """Σ_q ρ_rq s_q of the corners r, of the numbers s_q in the tile, into `corner_share`."""
    own, other = spread(rows.own - rows.other, rows.weight), spread(rows.other, rows.weight)
    s0, s1 = load(rows.tile, ROWS, lane), load(rows.tile, ROWS + 1, lane)
    s2, s3 = load(rows.tile, ROWS + 2, lane), load(rows.tile, ROWS + 3, lane)
    all_of = other * (s0 + s1 + s2 + s3)
    share = flat(rows.corner_share, CORNERS * block, CORNERS * (block + 1))
    save(all_of + own * s0, share, lane)
    save(all_of + own * s1, share, lane + BLOCK)
    save(all_of + own * s2, share, lane + 2 * BLOCK)
    save(all_of + own * s3, share, lane + 3 * BLOCK)


@njit_inlined
def add_corners(rows, out):
    """What the corners of all elements give to the volumes of the vertices, (m,)."""
    share = flat(rows.corner_share, 0, rows.corner_share.shape[0])
    start, entry = rows.volume_start, rows.volume_entry
    for r in range(start.shape[0] - 1):
        total = 0.0
        for k in range(start[r], start[r + 1]):
            total += share[entry[k]]
        out[r] = total


@njit_lean
def measure_into(rows, x, padded):
    """D_qa and −b (J_q − 1) of all points, V_r [m³], and dV/dx of the closed surface; `padded` (n, 4) holds `x`."""
    for block in range(blocks_of(rows)):
        gather_block(rows, padded, block)
        for lane in range(0, BLOCK, lanes_of(padded)):
            for q in range(POINTS):
                open_point(rows, block, q, lane)
            share_among_corners(rows, block, lane)
    add_corners(rows, rows.volume)
    if rows.closed_nodes.shape[0] > 0:
        inside = volume_gradient_into(x, rows.closed_triangles, rows.closed_gradient)
        rows.volume[rows.volume.shape[0] - 1] = inside


@njit_inlined
def push_block(rows, block, lane, stretched):
    """f_a = Σ_q p_q D_qa [N] of the elements of a block, p_q = Σ_r ρ_rq p_r and, where `stretched`, −b (J_q − 1)."""
    first = POINTS * block
    own, other = spread(rows.own - rows.other, rows.weight), spread(rows.other, rows.weight)
    p0, p1 = load(rows.corner_pressure, first, lane), load(rows.corner_pressure, first + 1, lane)
    p2, p3 = load(rows.corner_pressure, first + 2, lane), load(rows.corner_pressure, first + 3, lane)
    all_of = other * (p0 + p1 + p2 + p3)
    p0, p1, p2, p3 = all_of + own * p0, all_of + own * p1, all_of + own * p2, all_of + own * p3
    if stretched:
        p0, p1 = p0 + load(rows.stretch, first, lane), p1 + load(rows.stretch, first + 1, lane)
        p2, p3 = p2 + load(rows.stretch, first + 2, lane), p3 + load(rows.stretch, first + 3, lane)
    area, push, at = rows.area, flat(rows.element_push, ROWS * block, ROWS * (block + 1)), ROWS * first
    for k in range(ROWS):
        force = p0 * load(area, at + k, lane) + p1 * load(area, at + ROWS + k, lane)
        force = force + p2 * load(area, at + 2 * ROWS + k, lane) + p3 * load(area, at + 3 * ROWS + k, lane)
        save(force, push, k * BLOCK + lane)


@njit_inlined
def push_elements(rows, p, stretched):
    """`push_block` of all blocks with pressures `p` (m,) [Pa] of the volumes."""
    pressure, volume = (
        flat(rows.corner_pressure, 0, rows.corner_pressure.shape[0]),
        flat(rows.corner_volume, 0, rows.corner_volume.shape[0]),
    )
    for e in range(pressure.shape[0]):
        pressure[e] = p[volume[e]]
    for block in range(blocks_of(rows)):
        for lane in range(0, BLOCK, lanes_of(rows.weight)):
            push_block(rows, block, lane, stretched)


@njit_inlined
def push_of(rows, force, p, i):
    """The force on node i [N], of the elements around it and of the closed surface."""
    f0, f1, f2 = 0.0, 0.0, 0.0
    for k in range(rows.node_start[i], rows.node_start[i + 1]):
        at = rows.node_entry[k]
        f0, f1, f2 = f0 + force[at], f1 + force[at + BLOCK], f2 + force[at + 2 * BLOCK]
    if rows.closed_nodes.shape[0] > 0:
        inside = p[p.shape[0] - 1]
        f0, f1 = f0 + inside * rows.closed_gradient[i, 0], f1 + inside * rows.closed_gradient[i, 1]
        f2 = f2 + inside * rows.closed_gradient[i, 2]
    return f0, f1, f2


@njit_lean
def push_into(rows, p):
    """Jᵀ p and the force of −b (J_q − 1) [N] into `push`, (n, 3), with pressures `p` (m,) [Pa] (eq. 8.12)."""
    push_elements(rows, p, True)
    force = flat(rows.element_push, 0, rows.element_push.shape[0])
    for i in range(rows.push.shape[0]):
        rows.push[i, 0], rows.push[i, 1], rows.push[i, 2] = push_of(rows, force, p, i)


@njit_lean
def times_into(rows, u, product):
    """(J u)_r = Σ_q ρ_rq Σ_a D_qa·u_a of `u` (n, 4) with 0 as fourth number, (m,)."""
    for block in range(blocks_of(rows)):
        gather_block(rows, u, block)
        for lane in range(0, BLOCK, lanes_of(u)):
            for q in range(POINTS):
                first, total = ROWS * (POINTS * block + q), spread(0, u)
                for k in range(ROWS):
                    total = total + load(rows.area, first + k, lane) * load(rows.tile, k, lane)
                save(total, flat(rows.tile, ROWS + q, ROWS + q + 1), lane)
            share_among_corners(rows, block, lane)
    add_corners(rows, product)
    if rows.closed_nodes.shape[0] > 0:
        flow = 0.0
        for k in range(rows.closed_nodes.shape[0]):
            i = rows.closed_nodes[k]
            flow += rows.closed_gradient[i, 0] * u[i, 0] + rows.closed_gradient[i, 1] * u[i, 1]
            flow += rows.closed_gradient[i, 2] * u[i, 2]
        product[product.shape[0] - 1] = flow
