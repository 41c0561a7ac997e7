"""Sums over the points of quadratic tetrahedra: forces, volumes, their gradients, and products with both.

massspring.kernels.points.slopes defines W_i, A_i and the numbers n and o of a point.
"""

from massspring.kernels.forces.volume import volume_gradient_into
from massspring.kernels.jit.decorators import njit_inlined, njit_lean
from massspring.kernels.jit.flat import flat
from massspring.kernels.jit.vec3 import add_to, cross, dot, row, times
from massspring.kernels.jit.vectors import add_product, at_least, lanes_of, load, save, spread
from massspring.kernels.points.arrays import AREAS, BLOCK, CORNERS, POINTS, RIGIDITIES, SUMS
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
    scatter_block,
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
def name_pressures(elements, p, table):
    """The pressures `p` (m,) [Pa] of the volumes at the corners of all elements, into `table` (4 b, BLOCK)."""
    pressure, volume = flat(table, 0, table.shape[0]), flat(elements.corner_volume, 0, table.shape[0])
    for e in range(pressure.shape[0]):
        pressure[e] = p[volume[e]]


@njit_inlined
def pressures_at(elements, table, block, lane):
    """p_q = Σ_r ρ_rq p_r [Pa] at the four points of the elements of a block."""
    first, other = POINTS * block, spread(elements.other, table)
    own = spread(elements.own - elements.other, table)
    p0, p1 = load(table, first, lane), load(table, first + 1, lane)
    p2, p3 = load(table, first + 2, lane), load(table, first + 3, lane)
    all_of = other * (p0 + p1 + p2 + p3)
    return all_of + own * p0, all_of + own * p1, all_of + own * p2, all_of + own * p3


@njit_inlined
def bulk_at(rows, pressure):
    """b_q [Pa] at a point with that pressure [Pa], between that at rest and MOST_BULK (eq. 8.12b)."""
    like = rows.exact.tile
    risen = spread(BULK_PER_PRESSURE, like) * (pressure - spread(rows.rest_pressure, like))
    room = at_least(spread(MOST_BULK * rows.rest_pressure - rows.bulk, like), spread(0, like))
    left = at_least(room - at_least(risen, spread(0, like)), spread(0, like))
    return spread(rows.bulk, like) + room - left


@njit_inlined
def added(total, factor, vector):
    """total + factor vector, rounded once where the machine can."""
    return (
        add_product(total[0], factor, vector[0]),
        add_product(total[1], factor, vector[1]),
        add_product(total[2], factor, vector[2]),
    )


@njit_inlined
def load_rigidity(rows, point, lane):
    """C_ij of the three corners i with each corner j of a point."""
    c11, c12, c13 = load_three(rows.rigidity, RIGIDITIES * point, lane)
    c22, c23, c33 = load_three(rows.rigidity, RIGIDITIES * point + 3, lane)
    return (c11, c12, c13), (c12, c22, c23), (c13, c23, c33)


@njit_inlined
def pulled(force, rigidity, w):
    """force + Σ_j C_ij W_j of corner i: with C_ij = −mu w_q ∇b_i·∇b_j the force of the springs (eq. 4.9)."""
    return added(added(added(force, rigidity[0], w[0]), rigidity[1], w[1]), rigidity[2], w[2])


@njit_inlined
def strain_point(rows, block, q, pressures, between, lane):
    """A_i = W_j × W_k / 24 = w_q cof F_q ∇b_i into `area`, w_q J_q into the tile, and the force
    (p_q − b_q (J_q − 1)) A_i + Σ_j C_ij W_j of each of three corners; b_q follows the second of the `pressures` [Pa].
    Notes the smallest J."""
    elements, point, (pressure, eased) = rows.exact, block * POINTS + q, pressures
    w = slopes(elements, between, lane)
    part = spread(1.0 / 24.0, elements.tile)
    a1, a2 = times(part, cross(w[1], w[2])), times(part, cross(w[2], w[0]))
    a3 = times(part, cross(w[0], w[1]))
    now = dot(w[0], a1)
    squeezed = spread(1, elements.tile) - now * load(rows.per_weight, point, lane)
    save(at_least(squeezed, load(rows.most_squeezed, 0, lane)), flat(rows.most_squeezed, 0, 1), lane)
    save(now, flat(elements.tile, SUMS + q, SUMS + q + 1), lane)
    area = flat(rows.area, AREAS * point, AREAS * (point + 1))
    save_three(a1, area, lane)
    save_three(a2, area, lane + 3 * BLOCK)
    save_three(a3, area, lane + 6 * BLOCK)
    whole = load(elements.used, block, lane) * (pressure + bulk_at(rows, eased) * squeezed)
    c1, c2, c3 = load_rigidity(rows, point, lane)
    force = flat(elements.corner_force, AREAS * q, AREAS * (q + 1))
    save_three(pulled(times(whole, a1), c1, w), force, lane)
    save_three(pulled(times(whole, a2), c2, w), force, lane + 3 * BLOCK)
    save_three(pulled(times(whole, a3), c3, w), force, lane + 6 * BLOCK)


@njit_inlined
def share_among_corners(elements, block, lane):
    """Σ_q ρ_rq s_q at each corner r, with the numbers s_q in the tile, into `corner_share`."""
    tile = elements.tile
    own, other = spread(elements.own - elements.other, tile), spread(elements.other, tile)
    s0, s1 = load(tile, SUMS, lane), load(tile, SUMS + 1, lane)
    s2, s3 = load(tile, SUMS + 2, lane), load(tile, SUMS + 3, lane)
    all_of = other * (s0 + s1 + s2 + s3)
    share = flat(elements.corner_share, CORNERS * block, CORNERS * (block + 1))
    save(all_of + own * s0, share, lane)
    save(all_of + own * s1, share, lane + BLOCK)
    save(all_of + own * s2, share, lane + 2 * BLOCK)
    save(all_of + own * s3, share, lane + 3 * BLOCK)


@njit_inlined
def add_corners(elements, out):
    """Sums the contributions of the corners of all elements to the volumes of the tissue into `out` (m,)."""
    share = flat(elements.corner_share, 0, elements.corner_share.shape[0])
    start, entry = elements.volume_start, elements.volume_entry
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


@njit_inlined
def measure_closed(rows, x):
    """V and dV/dx of the closed surface."""
    if rows.closed_nodes.shape[0] > 0:
        inside = volume_gradient_into(x, rows.closed_triangles, rows.closed_gradient)
        rows.volume[rows.volume.shape[0] - 1] = inside


@njit_inlined
def push_closed(rows, elements, p):
    """Adds the force of the pressure in the closed surface to its nodes."""
    for k in range(rows.closed_nodes.shape[0]):
        i = rows.closed_nodes[k]
        add_to(elements.force, i, times(p[p.shape[0] - 1], row(rows.closed_gradient, i)))


@njit_inlined
def measure_point(elements, q, between, lane):
    """w_q J_q = det W / 24 into the tile."""
    w1, w2, w3 = slopes(elements, between, lane)
    now = spread(1.0 / 24.0, elements.tile) * dot(w1, cross(w2, w3))
    save(now, flat(elements.tile, SUMS + q, SUMS + q + 1), lane)


@njit_lean
def measure_into(rows, x, padded):
    """V_r [m³] and dV/dx of the closed surface; `padded` (n, 4) holds `x`."""
    elements = rows.exact
    for block in range(blocks_of(elements)):
        gather_block(elements, padded, block)
        for lane in range(0, BLOCK, lanes_of(padded)):
            open_block(elements, lane)
            measure_point(elements, 0, AT_0, lane)
            measure_point(elements, 1, AT_1, lane)
            measure_point(elements, 2, AT_2, lane)
            measure_point(elements, 3, AT_3, lane)
            share_among_corners(elements, block, lane)
    add_corners(elements, rows.volume)
    measure_closed(rows, x)


@njit_lean
def forces_into(rows, x, padded, p):
    """In one pass: V_r [m³], dV/dx of the closed surface, A_i, and into `exact.force` (n, 4) [N] the force of all
    volumes with pressures `p` (m,) [Pa], of −b_q (J_q − 1) and, where `elastic`, of the springs (eq. 4.9, 8.10, 8.12).

    `padded` (n, 4) holds `x`. b_q is that of the pressures `rows.eased`.
    """
    elements = rows.exact
    elements.force[:] = 0.0
    name_pressures(elements, p, elements.corner_pressure)
    name_pressures(elements, rows.eased, rows.corner_eased)
    for block in range(blocks_of(elements)):
        gather_block(elements, padded, block)
        for lane in range(0, BLOCK, lanes_of(padded)):
            open_block(elements, lane)
            p0, p1, p2, p3 = pressures_at(elements, elements.corner_pressure, block, lane)
            e0, e1, e2, e3 = pressures_at(elements, rows.corner_eased, block, lane)
            strain_point(rows, block, 0, (p0, e0), AT_0, lane)
            strain_point(rows, block, 1, (p1, e1), AT_1, lane)
            strain_point(rows, block, 2, (p2, e2), AT_2, lane)
            strain_point(rows, block, 3, (p3, e3), AT_3, lane)
            share_among_corners(elements, block, lane)
            for axis in range(3):
                push_along(elements, axis, lane)
        scatter_block(elements, block)
    add_corners(elements, rows.volume)
    measure_closed(rows, x)
    push_closed(rows, elements, p)


@njit_inlined
def press_point(rows, block, q, pressure, lane):
    """p_q A_i of three corners into `corner_force`."""
    area, force = AREAS * (POINTS * block + q), flat(rows.quick.corner_force, AREAS * q, AREAS * (q + 1))
    for side in range(3):
        save_three(times(pressure, load_three(rows.area, area + 3 * side, lane)), force, lane + 3 * side * BLOCK)


@njit_inlined
def force_of_corners(elements, q, axis, lane):
    """The forces of point q on four corners along an axis; they sum to 0."""
    first = AREAS * q + axis
    g1, g2 = load(elements.corner_force, first, lane), load(elements.corner_force, first + 3, lane)
    g3 = load(elements.corner_force, first + 6, lane)
    return spread(0, elements.push) - (g1 + g2 + g3), g1, g2, g3


@njit_inlined
def push_along(elements, axis, lane):
    """One component of `push`: (4 o − 1) Σ_q g_iq + 4 (n − o) g_ii on corner i, 4 o Σ_q (g_iq + g_jq) +
    4 (n − o)(g_ij + g_ji) between i and j, with the force g_iq of point q on corner i."""
    out = flat(elements.push, 0, elements.push.shape[0])
    g00, g10, g20, g30 = force_of_corners(elements, 0, axis, lane)
    g01, g11, g21, g31 = force_of_corners(elements, 1, axis, lane)
    g02, g12, g22, g32 = force_of_corners(elements, 2, axis, lane)
    g03, g13, g23, g33 = force_of_corners(elements, 3, axis, lane)
    corner, side = spread(4.0 * elements.other - 1.0, elements.push), spread(4.0 * elements.other, elements.push)
    nearer, at, row = spread(4.0 * (elements.own - elements.other), elements.push), axis * BLOCK + lane, 3 * BLOCK
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


@njit_lean
def push_into(rows, p):
    """Jᵀ p [N] into `quick.force` (n, 4), with pressures `p` (m,) [Pa] (eq. 8.11)."""
    elements = rows.quick
    elements.force[:] = 0.0
    name_pressures(elements, p, elements.corner_pressure)
    for block in range(blocks_of(elements)):
        for lane in range(0, BLOCK, lanes_of(elements.push)):
            p0, p1, p2, p3 = pressures_at(elements, elements.corner_pressure, block, lane)
            used = load(elements.used, block, lane)
            press_point(rows, block, 0, used * p0, lane)
            press_point(rows, block, 1, used * p1, lane)
            press_point(rows, block, 2, used * p2, lane)
            press_point(rows, block, 3, used * p3, lane)
            for axis in range(3):
                push_along(elements, axis, lane)
        scatter_block(elements, block)
    push_closed(rows, elements, p)


@njit_inlined
def flow_point(rows, block, q, between, lane):
    """Σ_a D_qa·u_a = Σ_i A_i·W_i of the tile's vector u, into the tile."""
    w1, w2, w3 = slopes(rows.quick, between, lane)
    first = AREAS * (POINTS * block + q)
    a1, a2 = load_three(rows.area, first, lane), load_three(rows.area, first + 3, lane)
    total = dot(a1, w1) + dot(a2, w2) + dot(load_three(rows.area, first + 6, lane), w3)
    save(total, flat(rows.quick.tile, SUMS + q, SUMS + q + 1), lane)


@njit_lean
def times_into(rows, u, product):
    """(J u)_r = Σ_q ρ_rq Σ_a D_qa·u_a of `u` (n, 4) float32 with 0 as fourth number, (m,)."""
    elements = rows.quick
    for block in range(blocks_of(elements)):
        gather_block(elements, u, block)
        for lane in range(0, BLOCK, lanes_of(u)):
            open_block(elements, lane)
            flow_point(rows, block, 0, AT_0, lane)
            flow_point(rows, block, 1, AT_1, lane)
            flow_point(rows, block, 2, AT_2, lane)
            flow_point(rows, block, 3, AT_3, lane)
            share_among_corners(elements, block, lane)
    add_corners(elements, product)
    if rows.closed_nodes.shape[0] > 0:
        flow = 0.0
        for k in range(rows.closed_nodes.shape[0]):
            i = rows.closed_nodes[k]
            flow += dot(row(rows.closed_gradient, i), row(u, i))
        product[product.shape[0] - 1] = flow
