"""Several volumes at once: the sparse rows J_r = dV_r/dx and what multiplies them (docs/theory.md, section 8)."""

import math

from massspring.kernels.contact.node_contact import FREE, after_contact, allowed
from massspring.kernels.jit.decorators import compiled, njit_lean
from massspring.kernels.jit.row_sums import copy_scaled, sum_of_areas, sum_of_products, sum_of_scaled, sums_from_origin
from massspring.kernels.jit.vec3 import dot, minus, plus, put, row, times

NEGLIGIBLE_DIAGONAL = 1e-12
"""Ratio to its summands below which a diagonal or pivot counts as round-off."""


@compiled
def rows_into(x, inverse_mass, rows):
    """J_rj [m²], the non-zero entries (e, 4), padded with 0, V_r [m³] (eq. 8.2, 8.6) and S_rr without contact
    [m⁴/kg]."""
    padded = rows.node_vector
    for i in range(x.shape[0]):
        put(padded, i, row(x, i))
    areas_into(rows, padded)
    for r in range(rows.volume.shape[0]):
        first, last = rows.row_start[r], rows.row_start[r + 1]
        three, square = 0.0, 0.0
        if last > first:
            three, square = sums_from_origin(first, last, rows.column, rows.value, padded, inverse_mass)
        rows.volume[r], rows.free_diagonal[r] = three / 3.0, square


@njit_lean
def areas_into(rows, padded):
    """J_rj = Σ_q c_q (x_2 − x_0) × (x_3 − x_1) [m²], the area of the ring of node j in volume r (eq. 8.6).

    Σ_j J_rj = 0. Where J_jr = −J_rj always, one of the two is summed.
    """
    value, node_value, target = rows.value, rows.node_value, rows.target
    for k in range(target.shape[0]):
        e, twin = target[k, 0], target[k, 2]
        sum_of_areas(rows.ring_start[k], rows.ring_start[k + 1], rows.corner, rows.corner_share, padded, value, e)
        copy_scaled(1.0, value, e, node_value, target[k, 1])
        if twin != e:
            copy_scaled(-1.0, value, e, value, twin)
            copy_scaled(-1.0, value, e, node_value, target[k, 3])


@compiled
def rows_times_into(rows, u, product):
    """(J u)_r = Σ_j J_rj · u_j, (m,)."""
    for r in range(product.shape[0]):
        total = 0.0
        for e in range(rows.row_start[r], rows.row_start[r + 1]):
            total += dot(row(rows.value, e), row(u, rows.column[e]))
        product[r] = total


@njit_lean
def padded_rows_times_into(rows, u, product):
    """(J u)_r as above for `u` (n, 4) with 0 as fourth number, twice as fast."""
    value, column, start = rows.value, rows.column, rows.row_start
    for r in range(product.shape[0]):
        product[r] = sum_of_products(start[r], start[r + 1], column, value, u)


@njit_lean
def transposed_rows_times_into(rows, p, out):
    """(Jᵀ p)_j = Σ_r J_rj p_r, (n, 3): with pressures p [Pa] the force of all volumes on each node [N]."""
    u, start, index, value = rows.node_vector, rows.node_start, rows.node_row, rows.node_value
    for j in range(out.shape[0]):
        sum_of_scaled(start[j], start[j + 1], index, value, p, 1.0, u, j)
    for j in range(out.shape[0]):
        put(out, j, row(u, j))


@compiled
def pushed_velocity_into(nodes, contacts, inverse_mass, force, dt, u):
    """u = ṽ + dt W̃ F [m/s], (n, 3), with a force F [N] on every node (eq. 3.4, 3.5)."""
    for i in range(u.shape[0]):
        pushed = plus(row(nodes.v_star, i), times(dt * inverse_mass[i], row(force, i)))
        put(u, i, after_contact(contacts, i, pushed))


@njit_lean
def mobilised_into(rows, contacts, inverse_mass, p, u):
    """u = W̃ Jᵀ p, (n, 4): no motion of a held node, none into an obstacle (eq. 3.4)."""
    start, index, value, mode = rows.node_start, rows.node_row, rows.node_value, contacts.mode
    for i in range(u.shape[0]):
        sum_of_scaled(start[i], start[i + 1], index, value, p, inverse_mass[i], u, i)
    for i in range(u.shape[0]):
        if mode[i] > FREE:
            put(u, i, allowed(contacts, i, row(u, i)))


@compiled
def diagonal_into(rows, contacts, inverse_mass, diagonal):
    """S_rr = Σ_j J_rj · W̃_j J_rj [m⁴/kg], (m,), computed from its value without contact (eq. 3.4).

    0 where contact and held nodes leave nothing but round-off.
    """
    for r in range(diagonal.shape[0]):
        diagonal[r] = rows.free_diagonal[r]
    for j in range(inverse_mass.shape[0]):
        if contacts.mode[j] > FREE:
            for k in range(rows.node_start[j], rows.node_start[j + 1]):
                g = row(rows.node_value, k)
                diagonal[rows.node_row[k]] -= inverse_mass[j] * dot(g, minus(g, allowed(contacts, j, g)))
    for r in range(diagonal.shape[0]):
        if not diagonal[r] > NEGLIGIBLE_DIAGONAL * rows.free_diagonal[r]:
            diagonal[r] = 0.0


@compiled
def steepest_of_row(rows, inverse_mass, r):
    """max_j w_j |J_rj| [m²/kg]: how far the node that moves most goes per unit of pressure and dt²."""
    steepest = 0.0
    for e in range(rows.row_start[r], rows.row_start[r + 1]):
        g = row(rows.value, e)
        steepest = max(steepest, inverse_mass[rows.column[e]] * math.sqrt(dot(g, g)))
    return steepest
