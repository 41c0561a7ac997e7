"""Sums over the points of quadratic tetrahedra: volumes, their gradients, and products with both.

massspring.kernels.points.slopes defines W_i, A_i and the numbers n and o of a point.
"""

from massspring.kernels.forces.volume import volume_gradient_into
from massspring.kernels.jit.decorators import njit_inlined, njit_lean
from massspring.kernels.jit.flat import flat
from massspring.kernels.jit.vec3 import cross, dot, plus, put, row, times
from massspring.kernels.jit.vectors import at_least, lanes_of, load, save, spread
from massspring.kernels.points.arrays import AREAS, BLOCK, CORNERS, POINTS, ROWS, SUMS
from massspring.kernels.points.slopes import (
    AT_0,
    AT_1,
    AT_2,
    AT_3,
    blocks_of,
    gather_block,
    load_three,
    open_block,
    save_three,
    slopes,
)

BULK_PER_PRESSURE = 2.0 / 3.0
"""Rise of b with the pressure of a point above that of rest: the least that keeps a point stable under pressure alone,
and enough in uniaxial and plane compression (docs/theory.md, eq. 8.12b)."""
MOST_BULK = 1.0
"""Largest b over the pressure at rest: enough in uniaxial compression by half, and in plane strain by 38 %. At the edge
of a held region pressures have no bound, and a step must bear b."""
EASE = 0.02
"""Part of a change of pressure that b follows in a step. Where J is far from 1 b changes the pressure that it follows:
five of six squeezed kidneys diverged where it followed at once."""


@njit_inlined
def name_pressures(rows, p):
    """The pressures `p` (m,) [Pa] of the volumes at the corners of all elements, into `corner_pressure`."""
    pressure, volume = (
        flat(rows.corner_pressure, 0, rows.corner_pressure.shape[0]),
        flat(rows.corner_volume, 0, rows.corner_volume.shape[0]),
    )
    for e in range(pressure.shape[0]):
        pressure[e] = p[volume[e]]


@njit_inlined
def pressures_at(rows, block, lane):
    """p_q = Σ_r ρ_rq p_r [Pa] at the four points of the elements of a block."""
    first, own, other = POINTS * block, spread(rows.own - rows.other, rows.tile), spread(rows.other, rows.tile)
    p0, p1 = load(rows.corner_pressure, first, lane), load(rows.corner_pressure, first + 1, lane)
    p2, p3 = load(rows.corner_pressure, first + 2, lane), load(rows.corner_pressure, first + 3, lane)
    all_of = other * (p0 + p1 + p2 + p3)
    return all_of + own * p0, all_of + own * p1, all_of + own * p2, all_of + own * p3


@njit_inlined
def bulk_at(rows, pressure):
    """b_q [Pa] at a point with that pressure [Pa], between that at rest and MOST_BULK (eq. 8.12b)."""
    risen = spread(BULK_PER_PRESSURE, rows.tile) * (pressure - spread(rows.rest_pressure, rows.tile))
    room = at_least(spread(MOST_BULK * rows.rest_pressure - rows.bulk, rows.tile), spread(0, rows.tile))
    left = at_least(room - at_least(risen, spread(0, rows.tile)), spread(0, rows.tile))
    return spread(rows.bulk, rows.tile) + room - left


@njit_inlined
def open_point(rows, block, q, pressure, between, lane):
    """A_i = W_j × W_k / 24 = w_q cof F_q ∇b_i of the positions in the tile into `area`, −b_q (J_q − 1) into `stretch`,
    w_q J_q into the tile; b_q from the pressure of the point [Pa]. Notes the smallest J."""
    w1, w2, w3 = slopes(rows, between, lane)
    part, point = spread(1.0 / 24.0, rows.tile), block * POINTS + q
    a1, a2, a3 = times(part, cross(w2, w3)), times(part, cross(w3, w1)), times(part, cross(w1, w2))
    now = dot(w1, a1)
    stretch, tile = flat(rows.stretch, point, point + 1), flat(rows.tile, SUMS + q, SUMS + q + 1)
    squeezed = spread(1, rows.tile) - now * load(rows.per_weight, point, lane)
    save(at_least(squeezed, load(rows.most_squeezed, 0, lane)), flat(rows.most_squeezed, 0, 1), lane)
    save(bulk_at(rows, pressure) * squeezed, stretch, lane)
    save(now, tile, lane)
    area = flat(rows.area, AREAS * point, AREAS * (point + 1))
    save_three(a1, area, lane)
    save_three(a2, area, lane + 3 * BLOCK)
    save_three(a3, area, lane + 6 * BLOCK)


@njit_inlined
def share_among_corners(rows, block, lane):
    """Σ_q ρ_rq s_q at each corner r, with the numbers s_q in the tile, into `corner_share`."""
    own, other = spread(rows.own - rows.other, rows.tile), spread(rows.other, rows.tile)
    s0, s1 = load(rows.tile, SUMS, lane), load(rows.tile, SUMS + 1, lane)
    s2, s3 = load(rows.tile, SUMS + 2, lane), load(rows.tile, SUMS + 3, lane)
    all_of = other * (s0 + s1 + s2 + s3)
    share = flat(rows.corner_share, CORNERS * block, CORNERS * (block + 1))
    save(all_of + own * s0, share, lane)
    save(all_of + own * s1, share, lane + BLOCK)
    save(all_of + own * s2, share, lane + 2 * BLOCK)
    save(all_of + own * s3, share, lane + 3 * BLOCK)


@njit_inlined
def add_corners(rows, out):
    """Sums the contributions of the corners of all elements to the volumes of the vertices into `out` (m,)."""
    share = flat(rows.corner_share, 0, rows.corner_share.shape[0])
    start, entry = rows.volume_start, rows.volume_entry
    for r in range(start.shape[0] - 1):
        total = 0.0
        for k in range(start[r], start[r + 1]):
            total += share[entry[k]]
        out[r] = total


@njit_lean
def ease_into(rows):
    """`eased` a step closer to the multipliers."""
    for r in range(rows.eased.shape[0]):
        rows.eased[r] += EASE * (rows.lam[r] - rows.eased[r])


@njit_lean
def measure_into(rows, x, padded):
    """A_i and −b_q (J_q − 1) of all points, V_r [m³], and dV/dx of the closed surface; `padded` (n, 4) holds `x`. b_q
    is that of the pressures `rows.eased`."""
    name_pressures(rows, rows.eased)
    for block in range(blocks_of(rows)):
        gather_block(rows, padded, block)
        for lane in range(0, BLOCK, lanes_of(padded)):
            open_block(rows, lane)
            p0, p1, p2, p3 = pressures_at(rows, block, lane)
            open_point(rows, block, 0, p0, AT_0, lane)
            open_point(rows, block, 1, p1, AT_1, lane)
            open_point(rows, block, 2, p2, AT_2, lane)
            open_point(rows, block, 3, p3, AT_3, lane)
            share_among_corners(rows, block, lane)
    add_corners(rows, rows.volume)
    if rows.closed_nodes.shape[0] > 0:
        inside = volume_gradient_into(x, rows.closed_triangles, rows.closed_gradient)
        rows.volume[rows.volume.shape[0] - 1] = inside


@njit_inlined
def push_block(rows, block, lane, stretched):
    """f_a = Σ_q p_q D_qa [N] of the elements of a block, p_q = Σ_r ρ_rq p_r and, where `stretched`, −b_q (J_q − 1)."""
    first, (p0, p1, p2, p3) = POINTS * block, pressures_at(rows, block, lane)
    if stretched:
        p0, p1 = p0 + load(rows.stretch, first, lane), p1 + load(rows.stretch, first + 1, lane)
        p2, p3 = p2 + load(rows.stretch, first + 2, lane), p3 + load(rows.stretch, first + 3, lane)
    for axis in range(3):
        push_along(rows, block, axis, (p0, p1, p2, p3), lane)


@njit_inlined
def pushes(rows, point, axis, pressure, lane):
    """p_q A_i of the four corners along an axis at one point; they sum to 0."""
    first = AREAS * point + axis
    g1, g2 = pressure * load(rows.area, first, lane), pressure * load(rows.area, first + 3, lane)
    g3 = pressure * load(rows.area, first + 6, lane)
    return spread(0, rows.tile) - (g1 + g2 + g3), g1, g2, g3


@njit_inlined
def push_along(rows, block, axis, pressure, lane):
    """Forces of a block along an axis: (4 o − 1) Σ_q g_iq + 4 (n − o) g_ii on corner i, 4 o Σ_q (g_iq + g_jq) +
    4 (n − o)(g_ij + g_ji) between i and j, with g_iq = p_q A_i at point q."""
    point, out = POINTS * block, flat(rows.element_push, ROWS * block, ROWS * (block + 1))
    g00, g10, g20, g30 = pushes(rows, point, axis, pressure[0], lane)
    g01, g11, g21, g31 = pushes(rows, point + 1, axis, pressure[1], lane)
    g02, g12, g22, g32 = pushes(rows, point + 2, axis, pressure[2], lane)
    g03, g13, g23, g33 = pushes(rows, point + 3, axis, pressure[3], lane)
    corner, side = spread(4.0 * rows.other - 1.0, rows.tile), spread(4.0 * rows.other, rows.tile)
    nearer, at, row = spread(4.0 * (rows.own - rows.other), rows.tile), axis * BLOCK + lane, 3 * BLOCK
    s0, s1, s2, s3 = g00 + g01 + g02 + g03, g10 + g11 + g12 + g13, g20 + g21 + g22 + g23, g30 + g31 + g32 + g33
    save(corner * s0 + nearer * g00, out, at)
    save(corner * s1 + nearer * g11, out, at + row)
    save(corner * s2 + nearer * g22, out, at + 2 * row)
    save(corner * s3 + nearer * g33, out, at + 3 * row)
    save(side * (s0 + s1) + nearer * (g01 + g10), out, at + 4 * row)
    save(side * (s1 + s2) + nearer * (g12 + g21), out, at + 5 * row)
    save(side * (s0 + s2) + nearer * (g02 + g20), out, at + 6 * row)
    save(side * (s0 + s3) + nearer * (g03 + g30), out, at + 7 * row)
    save(side * (s1 + s3) + nearer * (g13 + g31), out, at + 8 * row)
    save(side * (s2 + s3) + nearer * (g23 + g32), out, at + 9 * row)


@njit_inlined
def push_elements(rows, p, stretched):
    """`push_block` of all blocks with pressures `p` (m,) [Pa] of the volumes."""
    name_pressures(rows, p)
    for block in range(blocks_of(rows)):
        for lane in range(0, BLOCK, lanes_of(rows.tile)):
            push_block(rows, block, lane, stretched)


@njit_inlined
def push_of(rows, force, p, i):
    """The force on node i from the elements around it and from the closed surface [N]."""
    f = (0.0, 0.0, 0.0)
    for k in range(rows.node_start[i], rows.node_start[i + 1]):
        at = rows.node_entry[k]
        f = plus(f, (force[at], force[at + BLOCK], force[at + 2 * BLOCK]))
    if rows.closed_nodes.shape[0] > 0:
        f = plus(f, times(p[p.shape[0] - 1], row(rows.closed_gradient, i)))
    return f


@njit_lean
def push_into(rows, p):
    """Jᵀ p and the force of −b_q (J_q − 1) [N] into `push`, (n, 3), with pressures `p` (m,) [Pa] (eq. 8.12)."""
    push_elements(rows, p, True)
    force = flat(rows.element_push, 0, rows.element_push.shape[0])
    for i in range(rows.push.shape[0]):
        put(rows.push, i, push_of(rows, force, p, i))


@njit_inlined
def flow_point(rows, block, q, between, lane):
    """Σ_a D_qa·u_a = Σ_i A_i·W_i of the tile's vector u, into the tile."""
    w1, w2, w3 = slopes(rows, between, lane)
    first = AREAS * (POINTS * block + q)
    a1, a2 = load_three(rows.area, first, lane), load_three(rows.area, first + 3, lane)
    total = dot(a1, w1) + dot(a2, w2) + dot(load_three(rows.area, first + 6, lane), w3)
    save(total, flat(rows.tile, SUMS + q, SUMS + q + 1), lane)


@njit_lean
def times_into(rows, u, product):
    """(J u)_r = Σ_q ρ_rq Σ_a D_qa·u_a of `u` (n, 4) with 0 as fourth number, (m,)."""
    for block in range(blocks_of(rows)):
        gather_block(rows, u, block)
        for lane in range(0, BLOCK, lanes_of(u)):
            open_block(rows, lane)
            flow_point(rows, block, 0, AT_0, lane)
            flow_point(rows, block, 1, AT_1, lane)
            flow_point(rows, block, 2, AT_2, lane)
            flow_point(rows, block, 3, AT_3, lane)
            share_among_corners(rows, block, lane)
    add_corners(rows, product)
    if rows.closed_nodes.shape[0] > 0:
        flow = 0.0
        for k in range(rows.closed_nodes.shape[0]):
            i = rows.closed_nodes[k]
            flow += rows.closed_gradient[i, 0] * u[i, 0] + rows.closed_gradient[i, 1] * u[i, 1]
            flow += rows.closed_gradient[i, 2] * u[i, 2]
        product[product.shape[0] - 1] = flow
