"""Several volumes at once: the sparse rows J_r = dV_r/dx and what multiplies them (docs/theory.md, section 8)."""

import math

from massspring.kernels.compiled import compiled, inlined
from massspring.kernels.distances import allowed_part
from massspring.kernels.lanes import sum_of_products, sum_of_scaled

NEGLIGIBLE = 1e-12
"""A diagonal or pivot this much smaller than what it was summed from is round-off."""


@compiled
def rows_into(x, rows):
    """J_rj = Σ_f∋j s_rf (1/6) (x_b − x_a) × (x_c − x_a) [m²], the non-zero entries (e, 4), padded with 0 (eq. 32).

    One area vector a triangle serves its three nodes in every volume it bounds. Σ_j J_rj = 0. Where J_jr = −J_rj
    always, one of the two is summed.
    """
    normal = rows.normal
    for f in range(rows.triangles.shape[0]):
        a, b, c = rows.triangles[f, 0], rows.triangles[f, 1], rows.triangles[f, 2]
        a0, a1, a2 = x[a, 0], x[a, 1], x[a, 2]
        b0, b1, b2 = x[b, 0] - a0, x[b, 1] - a1, x[b, 2] - a2
        c0, c1, c2 = x[c, 0] - a0, x[c, 1] - a1, x[c, 2] - a2
        normal[f, 0], normal[f, 1], normal[f, 2] = b1 * c2 - b2 * c1, b2 * c0 - b0 * c2, b0 * c1 - b1 * c0
    for k in range(rows.summed.shape[0]):
        e, twin = rows.summed[k], rows.twin[k]
        g0, g1, g2 = 0.0, 0.0, 0.0
        for t in range(rows.term_start[k], rows.term_start[k + 1]):
            f, share = rows.term_triangle[t], rows.term_share[t]
            g0 += share * normal[f, 0]
            g1 += share * normal[f, 1]
            g2 += share * normal[f, 2]
        # An entry without a twin is its own: the second writing then stands.
        _write(rows, twin, -g0, -g1, -g2)
        _write(rows, e, g0, g1, g2)


@inlined
def _write(rows, e, g0, g1, g2):
    rows.value[e, 0], rows.value[e, 1], rows.value[e, 2] = g0, g1, g2
    k = rows.place[e]
    rows.node_value[k, 0], rows.node_value[k, 1], rows.node_value[k, 2] = g0, g1, g2


@compiled
def volumes_of_rows_into(x, rows, volume):
    """V_r = (1/3) Σ_j (x_j − x_o) · J_rj [m³], (m,) (eq. 32); o is a node of the volume, so that no digits are lost."""
    for r in range(volume.shape[0]):
        o = rows.column[rows.row_start[r]]
        o0, o1, o2 = x[o, 0], x[o, 1], x[o, 2]
        three = 0.0
        for e in range(rows.row_start[r], rows.row_start[r + 1]):
            j = rows.column[e]
            three += (x[j, 0] - o0) * rows.value[e, 0]
            three += (x[j, 1] - o1) * rows.value[e, 1]
            three += (x[j, 2] - o2) * rows.value[e, 2]
        volume[r] = three / 3.0


@compiled
def rows_times_into(rows, u, product):
    """(J u)_r = Σ_j J_rj · u_j, (m,)."""
    for r in range(product.shape[0]):
        total = 0.0
        for e in range(rows.row_start[r], rows.row_start[r + 1]):
            j = rows.column[e]
            total += rows.value[e, 0] * u[j, 0] + rows.value[e, 1] * u[j, 1] + rows.value[e, 2] * u[j, 2]
        product[r] = total


@compiled
def padded_rows_times_into(rows, u, product):
    """(J u)_r as above for `u` (n, 4) with 0 as fourth number, twice as fast."""
    for r in range(product.shape[0]):
        product[r] = sum_of_products(rows.row_start[r], rows.row_start[r + 1], rows.column, rows.value, u)


@compiled
def transposed_rows_times_into(rows, p, out):
    """(Jᵀ p)_j = Σ_r J_rj p_r, (n, 3): with pressures p [Pa] the force of all volumes on each node [N]."""
    u = rows.node_vector
    for j in range(out.shape[0]):
        sum_of_scaled(rows.node_start[j], rows.node_start[j + 1], rows.node_row, rows.node_value, p, u, j)
        out[j, 0], out[j, 1], out[j, 2] = u[j, 0], u[j, 1], u[j, 2]


@compiled
def pushed_velocity_into(motion, inverse_mass, dt, u):
    """u = ṽ + dt W̃ F [m/s], (n, 3), with F = Jᵀ lam in `motion.gradient` [N] (eq. 9, 10)."""
    for i in range(u.shape[0]):
        push = dt * inverse_mass[i]
        u0 = motion.v_star[i, 0] + push * motion.gradient[i, 0]
        u1 = motion.v_star[i, 1] + push * motion.gradient[i, 1]
        u2 = motion.v_star[i, 2] + push * motion.gradient[i, 2]
        if motion.locked[i] > 0:
            d0, d1, d2 = motion.direction[i, 0], motion.direction[i, 1], motion.direction[i, 2]
            u0, u1, u2 = allowed_part(motion.locked[i], d0, d1, d2, u0, u1, u2)
            u0, u1, u2 = u0 + motion.goal[i, 0], u1 + motion.goal[i, 1], u2 + motion.goal[i, 2]
        u[i, 0], u[i, 1], u[i, 2] = u0, u1, u2


@compiled
def mobilised_into(rows, motion, inverse_mass, p, u):
    """u = W̃ Jᵀ p, (n, 4): no motion of a held node, none into an obstacle (eq. 9)."""
    for i in range(u.shape[0]):
        sum_of_scaled(rows.node_start[i], rows.node_start[i + 1], rows.node_row, rows.node_value, p, u, i)
        w = inverse_mass[i]
        u0, u1, u2 = w * u[i, 0], w * u[i, 1], w * u[i, 2]
        if motion.locked[i] > 0:
            d0, d1, d2 = motion.direction[i, 0], motion.direction[i, 1], motion.direction[i, 2]
            u0, u1, u2 = allowed_part(motion.locked[i], d0, d1, d2, u0, u1, u2)
        u[i, 0], u[i, 1], u[i, 2] = u0, u1, u2


@compiled
def diagonal_into(rows, motion, inverse_mass, diagonal):
    """S_rr = Σ_j J_rj · W̃_j J_rj [m⁴/kg], (m,); 0 where contact and held nodes leave nothing but round-off."""
    for r in range(diagonal.shape[0]):
        total, free = 0.0, 0.0
        for e in range(rows.row_start[r], rows.row_start[r + 1]):
            j = rows.column[e]
            g0, g1, g2 = rows.value[e, 0], rows.value[e, 1], rows.value[e, 2]
            square = g0 * g0 + g1 * g1 + g2 * g2
            free += square * inverse_mass[j]
            if motion.locked[j] > 0:
                d0, d1, d2 = motion.direction[j, 0], motion.direction[j, 1], motion.direction[j, 2]
                p0, p1, p2 = allowed_part(motion.locked[j], d0, d1, d2, g0, g1, g2)
                square = g0 * p0 + g1 * p1 + g2 * p2
            total += inverse_mass[j] * square
        diagonal[r] = total if total > NEGLIGIBLE * free else 0.0


@compiled
def steepest_of_row(rows, inverse_mass, r):
    """max_j w_j |J_rj| [m²/kg]: how far the node that moves most goes per unit of pressure and dt²."""
    steepest = 0.0
    for e in range(rows.row_start[r], rows.row_start[r + 1]):
        g0, g1, g2 = rows.value[e, 0], rows.value[e, 1], rows.value[e, 2]
        steepest = max(steepest, inverse_mass[rows.column[e]] * math.sqrt(g0 * g0 + g1 * g1 + g2 * g2))
    return steepest
