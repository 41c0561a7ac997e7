"""An approximate S⁻¹ at rest on two levels: dense over the vertices, and blocks of near volumes for the rest."""

from massspring.kernels.jit.decorators import njit_exposed, njit_inlined, njit_reassociated
from massspring.kernels.jit.flat import flat
from massspring.kernels.jit.vectors import add_product, put_row, row_of, spread_row
from massspring.kernels.points.arrays import NEAR_SIZE


@njit_reassociated
def product_of(row, vector):
    """row · vector in single precision: it need not be exact."""
    total = row[0] * vector[0]
    for k in range(1, row.shape[0]):
        total += row[k] * vector[k]
    return total


@njit_inlined
def answer_far(inverse, residual, product):
    """P C Pᵀ residual (eq. 8.13)."""
    start, of, weight, moment = inverse.coarse_start, inverse.coarse, inverse.weight, inverse.moment
    for c in range(moment.shape[0]):
        moment[c] = 0.0
    for r in range(residual.shape[0]):
        for k in range(start[r], start[r + 1]):
            moment[of[k]] += weight[k] * residual[r]
    for c in range(moment.shape[0]):
        inverse.scaled[c] = inverse.coarse_scale[c] * moment[c]
    for c in range(moment.shape[0]):
        moment[c] = inverse.coarse_scale[c] * product_of(flat(inverse.far, c, c + 1), inverse.scaled)
    for r in range(residual.shape[0]):
        total = 0.0
        for k in range(start[r], start[r + 1]):
            total += weight[k] * moment[of[k]]
        product[r] = total


@njit_inlined
def answer_near(inverse, residual, product):
    """Adds R residual, cluster by cluster; blocks lie column by column, so that sums stay in a register."""
    order, scale, part, near = inverse.order, inverse.scale, inverse.part, inverse.near
    m = order.shape[0]
    for k in range(m):
        part[k // NEAR_SIZE, k % NEAR_SIZE] = scale[order[k]] * residual[order[k]]
    last = part.shape[0] - 1
    for b in range(last):
        even = spread_row(0.0, row_of(near, 0, NEAR_SIZE))
        odd = even  # two sums, so that one addition need not wait for the other
        for k in range(inverse.near_start[b], inverse.near_start[b + 1]):
            other = inverse.near_cluster[k]
            for j in range(0, NEAR_SIZE, 2):
                at = NEAR_SIZE * k + j
                one, two = row_of(near, at, NEAR_SIZE), row_of(near, at + 1, NEAR_SIZE)
                even = add_product(even, one, spread_row(part[other, j], one))
                odd = add_product(odd, two, spread_row(part[other, j + 1], two))
        put_row(even + odd, part, last)
        for j in range(min(NEAR_SIZE, m - NEAR_SIZE * b)):
            r = order[NEAR_SIZE * b + j]
            product[r] += scale[r] * part[last, j]


@njit_exposed
def precondition_into(inverse, residual, product):
    """z ≈ S⁻¹ residual with S at rest, which does not depend on the rotation of the body; returns residual · z."""
    answer_far(inverse, residual, product)
    if inverse.near_cluster.shape[0] > 0:
        answer_near(inverse, residual, product)
    rho = 0.0
    for r in range(residual.shape[0]):
        rho += residual[r] * product[r]
    return rho
