"""A preconditioner for many multipliers: S⁻¹ within clusters of volumes, without the coupling between clusters (eq.
8.7)."""

import math

from massspring.kernels.arrays.volume_rows import SIZE
from massspring.kernels.jit.decorators import njit_exposed, njit_inlined
from massspring.kernels.jit.vectors import add_product, put_row, row_of, spread_row


@njit_exposed
def scale_into(clusters, diagonal):
    """1/√S_rr of the current S, by which the inverse at rest is scaled as volumes grow or contact removes
    directions."""
    for k in range(clusters.order.shape[0]):
        own = diagonal[clusters.order[k]]
        clusters.scale[k] = 1.0 / math.sqrt(own) if own > 0.0 else 0.0


@njit_inlined
def answer(inverse, first, part):
    """part[1] = inverse · part[0] for the cluster that begins at row `first`; its rows serve as columns, as
    the inverse is symmetric, and all sums stay in vector registers."""
    total = spread_row(0.0, row_of(inverse, first, SIZE))
    for k in range(SIZE):
        column = row_of(inverse, first + k, SIZE)
        total = add_product(total, column, spread_row(part[0, k], column))
    put_row(total, part, 1)


@njit_exposed
def precondition_into(clusters, residual, product):
    """z ≈ S⁻¹ residual, cluster by cluster (eq. 8.7), 0 for what nothing can push; returns residual · z."""
    order, scale, part = clusters.order, clusters.scale, clusters.part
    rho = 0.0
    for first in range(0, order.shape[0], SIZE):
        size = min(SIZE, order.shape[0] - first)
        for i in range(size):
            part[0, i] = scale[first + i] * residual[order[first + i]]
        for i in range(size, SIZE):
            part[0, i] = 0.0
        answer(clusters.inverse, first, part)
        for i in range(size):
            r = order[first + i]
            z = scale[first + i] * part[1, i]
            product[r] = z
            rho += residual[r] * z
    return rho
