"""Rows of a table as one flat array, so that the compiler can vectorise loops over all nodes.

Compilers do not vectorise loops over rows of three, or loops that do not begin at 0; such loops take three times as
long. Slicing and `reshape` are calls that cost a small body more than its loop; this view is an address and a length.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import lower_builtin, type_callable
from numba.np.arrayobj import populate_array

from massspring.kernels.jit.decorators import njit_inlined


def flat(table: np.ndarray, first: int, last: int) -> np.ndarray:
    """Rows first ≤ i < last of a contiguous table (n,) or (n, k) as a view, ((last − first) k,)."""
    return table[first:last].reshape(-1)


@type_callable(flat)
def _type_of_flat(context: Any) -> Any:
    def view(table: Any, first: Any, last: Any) -> Any:
        if isinstance(table, types.Array) and table.layout == "C" and table.ndim <= 2:
            return types.Array(table.dtype, 1, "C")
        return None

    return view


@lower_builtin(flat, types.Array, types.Integer, types.Integer)
def _flat(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    table, word = signature.args[0], context.get_value_type(types.intp)
    first, last = (context.cast(builder, args[k], signature.args[k], types.intp) for k in (1, 2))
    source = context.make_array(table)(context, builder, args[0])
    width = cgutils.unpack_tuple(builder, source.shape)[1] if table.ndim == 2 else ir.Constant(word, 1)
    view = context.make_array(signature.return_type)(context, builder)
    # Without a parent: the caller keeps the array alive, and no references are counted.
    populate_array(
        view,
        data=builder.gep(source.data, [builder.mul(first, width)]),
        shape=[builder.mul(builder.sub(last, first), width)],
        strides=[source.itemsize],
        itemsize=source.itemsize,
        meminfo=None,
    )
    return view._getvalue()


BLOCK = 64
"""Nodes per block."""


@njit_inlined
def any_gap_within(gap, begin, reach):
    """Whether the block from `begin` on has a node with a gap of at most `reach` [m]; always true for a block that is
    not full.

    NaN counts as near.
    """
    if begin + BLOCK > gap.shape[0]:
        return True
    block, near = flat(gap, begin, begin + BLOCK), 0
    for i in range(BLOCK):
        near += not block[i] > reach
    return near > 0
