"""A preconditioner for many multipliers: S⁻¹ within clusters of volumes, without the coupling between clusters (eq.
8.7)."""

import math
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload

from massspring.kernels.arrays.volume_rows import SIZE
from massspring.kernels.jit.decorators import njit_exposed
from massspring.kernels.jit.row_sums import INLINED
from massspring.kernels.jit.simd4 import plus, spread_over


@njit_exposed
def scale_into(clusters, diagonal):
    """1/√S_rr of the current S, by which the inverse at rest is scaled as volumes grow or contact removes
    directions."""
    for k in range(clusters.order.shape[0]):
        own = diagonal[clusters.order[k]]
        clusters.scale[k] = 1.0 / math.sqrt(own) if own > 0.0 else 0.0


def answer(inverse, first, part):
    """part[1] = inverse · part[0] for the cluster that begins at row `first`; the inverse is symmetric."""
    part[1] = part[0] @ inverse[first : first + SIZE]


@intrinsic
def _answer(typingctx: Any, inverse: Any, first: Any, part: Any) -> Any:
    """The product column by column, with all sums of the cluster in vector registers."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        numbers = ir.VectorType(ir.FloatType(), SIZE)
        index, width = ir.IntType(64), ir.Constant(ir.IntType(64), SIZE)
        columns, both = (context.make_array(signature.args[at])(context, builder, args[at]).data for at in (0, 2))
        total = cgutils.alloca_once_value(builder, ir.Constant(numbers, [0.0] * SIZE))
        with cgutils.for_range(builder, width) as loop:
            share = builder.load(builder.gep(both, [loop.index]))
            row = builder.mul(builder.add(args[1], loop.index), width)
            column = builder.load(builder.bitcast(builder.gep(columns, [row]), numbers.as_pointer()), align=4)
            spread = spread_over(builder, share, numbers)
            builder.store(plus(builder, builder.load(total), column, spread), total)
        where = builder.bitcast(builder.gep(both, [ir.Constant(index, SIZE)]), numbers.as_pointer())
        builder.store(builder.load(total), where, align=4)
        return context.get_dummy_value()

    return types.void(inverse, types.intp, part), generate


@overload(answer, jit_options=INLINED)
def _compiled_answer(inverse, first, part):
    return lambda inverse, first, part: _answer(inverse, first, part)  # pyright: ignore[reportCallIssue]


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
