"""Four numbers of a sparse row's entry at once: sums along a row in one vector register.

The compiler vectorises loops, not the components of an entry, so these two sums spell it out. The plain functions say
what they do and serve where nothing is compiled.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload

LANES = 4


def sum_of_scaled(start, stop, index, value, factor, out, place):
    """out_place = Σ_e factor[index_e] value_e over start ≤ e < stop; `value` (e, 4), `out` (·, 4)."""
    out[place, :] = 0.0
    for e in range(start, stop):
        out[place] += factor[index[e]] * value[e]


def sum_of_products(start, stop, index, value, field):
    """Σ_e field[index_e] · value_e over start ≤ e < stop; `value` (e, 4), `field` (·, 4)."""
    total = 0.0
    for e in range(start, stop):
        total += float(field[index[e]] @ value[e])
    return total


def _address(builder: Any, kind: Any, array: Any, row: Any) -> Any:
    """Of the first number in `row`, rows of one or of four numbers."""
    width = LANES if kind.ndim == 2 else 1
    return builder.gep(array.data, [builder.mul(row, ir.Constant(row.type, width))])


def _four(builder: Any, address: Any) -> Any:
    """The pointer to one number as one to four; as aligned as one number."""
    return builder.bitcast(address, ir.VectorType(address.type.pointee, LANES).as_pointer())


def _total(context: Any, builder: Any, signature: Any, args: Any, scaled: bool) -> Any:
    """Σ_e of value_e, times a number or lane by lane with a row of the last array; a vector."""
    start, stop = args[0], args[1]
    kinds = signature.args[2:5]
    index, value, other = (
        context.make_array(kind)(context, builder, arg) for kind, arg in zip(kinds, args[2:5], strict=True)
    )
    real = context.get_value_type(kinds[1].dtype)
    vector = ir.VectorType(real, LANES)
    align = kinds[1].dtype.bitwidth // 8
    total = cgutils.alloca_once_value(builder, ir.Constant(vector, [0.0] * LANES))
    with cgutils.for_range_slice(builder, start, stop, ir.Constant(start.type, 1)) as (e, _):
        where = builder.zext(builder.load(_address(builder, kinds[0], index, e)), start.type)
        entry = builder.load(_four(builder, _address(builder, kinds[1], value, e)), align=align)
        address = _address(builder, kinds[2], other, where)
        if scaled:
            number = context.cast(builder, builder.load(address), kinds[2].dtype, kinds[1].dtype)
            single = builder.insert_element(ir.Constant(vector, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
            zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
            factor = builder.shuffle_vector(single, ir.Constant(vector, ir.Undefined), zeros)
        else:
            factor = builder.load(_four(builder, address), align=align)
        builder.store(builder.fadd(builder.load(total), builder.fmul(entry, factor)), total)
    return builder.load(total)


@intrinsic
def _scaled(typingctx: Any, start: Any, stop: Any, index: Any, value: Any, factor: Any, out: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        total = _total(context, builder, signature, args, scaled=True)
        target = context.make_array(signature.args[5])(context, builder, args[5])
        address = _address(builder, signature.args[5], target, args[6])
        builder.store(total, _four(builder, address), align=out.dtype.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(types.intp, types.intp, index, value, factor, out, types.intp), generate


@intrinsic
def _products(typingctx: Any, start: Any, stop: Any, index: Any, value: Any, field: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        total = _total(context, builder, signature, args, scaled=False)
        a, b, c, d = (builder.extract_element(total, ir.Constant(ir.IntType(32), lane)) for lane in range(LANES))
        return builder.fadd(builder.fadd(a, b), builder.fadd(c, d))

    return value.dtype(types.intp, types.intp, index, value, field), generate


@overload(sum_of_scaled)
def _compiled_scaled(start, stop, index, value, factor, out, place):
    return lambda start, stop, index, value, factor, out, place: _scaled(start, stop, index, value, factor, out, place)  # pyright: ignore[reportCallIssue]


@overload(sum_of_products)
def _compiled_products(start, stop, index, value, field):
    return lambda start, stop, index, value, field: _products(start, stop, index, value, field)  # pyright: ignore[reportCallIssue]
