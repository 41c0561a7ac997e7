# pyright: reportCallIssue=false, reportOptionalCall=false
"""Vector registers as values: numbers of several nodes side by side, or the four of one row; +, −, ×, ÷ lane by lane.

The compiler makes vectors of loops over arrays in memory, not of sums that stay in registers over a loop. The plain
functions define the results, with NumPy arrays as vectors, and are used when nothing is compiled.
"""

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import binding, ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model, type_callable

BYTES = 64 if binding.get_host_cpu_features().get("avx512f") else 32
"""Size of a vector register [bytes]; results do not depend on it."""


def lanes_of(table: np.ndarray) -> int:
    """How many numbers of the type of `table` a register holds."""
    return BYTES // table.itemsize


def spread(number: Any, table: np.ndarray) -> Any:
    """One number in all lanes, in the precision of `table`."""
    return np.full(lanes_of(table), number, dtype=table.dtype)


def load(table: np.ndarray, row: int, column: int) -> Any:
    """As many numbers of a row as a register holds, from `column` on."""
    return table[row, column : column + lanes_of(table)].copy()


def save(vector: Any, table: np.ndarray, at: int) -> None:
    """The lanes into a flat table from `at` on; rounded where it is of single precision."""
    table[at : at + len(vector)] = vector


def gather(padded: np.ndarray, nodes: np.ndarray, row: int, column: int) -> tuple[Any, Any, Any]:
    """x, y and z of as many nodes as a register has lanes; `padded` (n, 4), so that one load fetches a node."""
    x, y, z, _ = padded[nodes[row, column : column + lanes_of(padded)]].T
    return x, y, z


def scatter(vectors: tuple[Any, Any, Any], padded: np.ndarray, nodes: np.ndarray, row: int, column: int) -> None:
    """Adds x, y and z of each lane to the row of its node, the inverse of `gather`; lanes in their order, since several
    may name one node."""
    lanes = lanes_of(padded)
    for lane, node in enumerate(nodes[row, column : column + lanes]):
        padded[node, :3] += [component[lane] for component in vectors]


def root(vector: Any) -> Any:
    """√ of each lane."""
    return np.sqrt(vector)


def at_least(vector: Any, least: Any) -> Any:
    """The larger of each lane and `least`; NaN stays NaN."""
    return np.where(vector < least, least, vector)


def add_product(total: Any, a: Any, b: Any) -> Any:
    """total + a b, rounded once where the machine can."""
    return total + a * b


def row_of(table: np.ndarray, row: int, count: int) -> Any:
    """The numbers of a row; `table` (n, count), the count a constant."""
    return table[row].copy()


def four(padded: np.ndarray, row: int) -> Any:
    """The numbers of a row; `padded` (n, 4)."""
    return padded[row].copy()


def put_row(vector: Any, table: np.ndarray, row: int) -> None:
    """Stores them."""
    table[row] = vector


def spread_row(number: Any, like: Any) -> Any:
    """One number in all lanes of a vector like `like`, or in four lanes in the precision of the table `like`."""
    return np.full(like.shape[-1], number, dtype=like.dtype)


def doubled(vector: Any) -> Any:
    """Four numbers in double precision."""
    return vector.astype(np.float64)


def turned(vector: Any) -> Any:
    """(y, z, x, 0) of (x, y, z, 0)."""
    return vector[[1, 2, 0, 3]]


def unless(condition: bool, vector: Any) -> Any:
    """The vector, or zeros if `condition`; both are computed, so that there is no branch."""
    return np.zeros_like(vector) if condition else vector


def across(vector: Any) -> float:
    """The sum of four lanes."""
    return (vector[0] + vector[1]) + (vector[2] + vector[3])


class Vector(types.Type):
    """The numbers of one register, or `count` of them."""

    def __init__(self, real: Any, count: int = 0) -> None:
        self.real, self.count = real, count or 8 * BYTES // real.bitwidth
        super().__init__(name=f"vector({real} x {self.count})")


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, ir.VectorType(manager.lookup(kind.real).get_value_type(), kind.count))


def _generates(function: Callable[..., Any], result: Callable[..., Any], *kinds: Any) -> Callable[..., Any]:
    """Decorates the code generator of a function; `result` gives the type of its value from those of its arguments."""
    type_callable(function)(lambda context: result)
    return lower_builtin(function, *kinds)


def _operation(function: Callable[..., Any], instruction: str) -> None:
    """+, −, × or ÷ of two vectors."""

    class Typed(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if len(args) == 2 and isinstance(args[0], Vector) and args[0] == args[1]:
                return signature(args[0], *args)
            return None

    infer_global(function)(Typed)

    @lower_builtin(function, Vector, Vector)
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return getattr(builder, instruction)(*args)


for _function, _instruction in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _operation(_function, _instruction)


@_generates(lanes_of, lambda table: types.intp, types.Array)
def _lanes(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    return context.get_constant(types.intp, 8 * BYTES // signature.args[0].dtype.bitwidth)


@lower_builtin(spread_row, types.Number, Vector)
@_generates(
    spread_row,
    lambda number, like: like if isinstance(like, Vector) else Vector(like.dtype, 4),
    types.Number,
    types.Array,
)
@_generates(spread, lambda number, table: Vector(table.dtype), types.Number, types.Array)
def _spread(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    kind = signature.return_type
    number = context.cast(builder, args[0], signature.args[0], kind.real)
    none = ir.Constant(context.get_value_type(kind), ir.Undefined)
    single = builder.insert_element(none, number, ir.Constant(ir.IntType(32), 0))
    return _shuffled(builder, single, none, [0] * kind.count)


def _shuffled(builder: Any, a: Any, b: Any, order: list[int]) -> Any:
    """Lanes of a, then of b, in any order."""
    return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(ir.IntType(32), len(order)), order))


def _address(context: Any, builder: Any, kind: Any, array: Any, indices: list[tuple[Any, Any]]) -> Any:
    """Address of a number of a contiguous table."""
    table = context.make_array(kind)(context, builder, array)
    at = [context.cast(builder, value, of, types.intp) for value, of in indices]
    if len(at) == 1:
        return builder.gep(table.data, at)
    width = cgutils.unpack_tuple(builder, table.shape)[1]
    return builder.gep(table.data, [builder.add(builder.mul(at[0], width), at[1])])


def _bytes(kind: Any) -> int:
    return kind.dtype.bitwidth // 8


@_generates(load, lambda table, row, column: Vector(table.dtype), types.Array, types.Integer, types.Integer)
def _load(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    kinds = signature.args
    pointer = _address(context, builder, kinds[0], args[0], [(args[1], kinds[1]), (args[2], kinds[2])])
    vector = context.get_value_type(signature.return_type)
    return builder.load(builder.bitcast(pointer, vector.as_pointer()), align=_bytes(kinds[0]))


@_generates(save, lambda vector, table, at: types.void, Vector, types.Array, types.Integer)
def _save(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    kinds = signature.args
    pointer = _address(context, builder, kinds[1], args[1], [(args[2], kinds[2])])
    vector, target = args[0], ir.VectorType(pointer.type.pointee, args[0].type.count)
    vector = vector if vector.type == target else builder.fptrunc(vector, target)
    builder.store(vector, builder.bitcast(pointer, target.as_pointer()), align=_bytes(kinds[1]))
    return context.get_dummy_value()


@_generates(
    gather,
    lambda padded, nodes, row, column: types.UniTuple(Vector(padded.dtype), 3),
    types.Array,
    types.Array,
    types.Integer,
    types.Integer,
)
def _gather(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    padded, nodes, row_kind, column_kind = signature.args
    first = _address(context, builder, nodes, args[1], [(args[2], row_kind), (args[3], column_kind)])
    base = context.make_array(padded)(context, builder, args[0]).data
    four, word = ir.VectorType(base.type.pointee, 4), context.get_value_type(types.intp)
    rows = []
    for lane in range(signature.return_type.dtype.count):
        node = builder.zext(builder.load(builder.gep(first, [word(lane)])), word)
        pointer = builder.gep(base, [builder.mul(node, word(4))])
        rows.append(builder.load(builder.bitcast(pointer, four.as_pointer()), align=_bytes(padded)))
    turned = _turned_double if padded.dtype.bitwidth == 64 else _turned_single
    return context.make_tuple(builder, signature.return_type, turned(builder, rows))


def _joined(builder: Any, parts: list[Any]) -> Any:
    """Short vectors one after the other in a long one."""
    while len(parts) > 1:
        length = 2 * parts[0].type.count
        parts = [_shuffled(builder, a, b, list(range(length))) for a, b in zip(parts[::2], parts[1::2], strict=True)]
    return parts[0]


def _turned_double(builder: Any, rows: list[Any]) -> list[Any]:
    """x, y and z from rows (x, y, z, 0): first pairs within 128 bits are exchanged, then whole pairs, one instruction
    each."""
    half, width = len(rows) // 2, len(rows)
    quarters = [_joined(builder, rows[begin : begin + half : 2]) for begin in (0, 1, half, half + 1)]
    fours = range(0, width, 4)

    def pairs(a: Any, b: Any, component: int) -> Any:
        order = [k + at for k in fours for pair in (0, 2) for at in (pair + component, width + pair + component)]
        return _shuffled(builder, a, b, order)

    even, odd = ([pairs(*two, component) for two in (quarters[:2], quarters[2:])] for component in (0, 1))
    low = [begin + k + at for begin in (0, width) for k in fours for at in (0, 1)]
    return [
        _shuffled(builder, *even, low),
        _shuffled(builder, *odd, low),
        _shuffled(builder, *even, [at + 2 for at in low]),
    ]


def _turned_single(builder: Any, rows: list[Any]) -> list[Any]:
    """The same in single precision: each row fills 128 bits, and four rows are transposed within them."""
    width = len(rows)
    quarters = [_joined(builder, rows[begin::4]) for begin in range(4)]

    def picked(a: Any, b: Any, first: int, second: int) -> Any:
        fours = range(0, width, 4)
        return _shuffled(
            builder, a, b, [k + at for k in fours for at in (first, second, width + first, width + second)]
        )

    even, odd = ([picked(*two, begin, begin + 2) for two in (quarters[:2], quarters[2:])] for begin in (0, 1))
    return [picked(*even, 0, 2), picked(*odd, 0, 2), picked(*even, 1, 3)]


@_generates(
    scatter,
    lambda vectors, padded, nodes, row, column: types.void,
    types.UniTuple,
    types.Array,
    types.Array,
    types.Integer,
    types.Integer,
)
def _scatter(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    _, padded, nodes, row_kind, column_kind = signature.args
    first = _address(context, builder, nodes, args[2], [(args[3], row_kind), (args[4], column_kind)])
    base = context.make_array(padded)(context, builder, args[1]).data
    four, word = ir.VectorType(base.type.pointee, 4), context.get_value_type(types.intp)
    turned = _rows_double if padded.dtype.bitwidth == 64 else _rows_single
    for lane, row in enumerate(turned(builder, cgutils.unpack_tuple(builder, args[0]))):
        node = builder.zext(builder.load(builder.gep(first, [word(lane)])), word)
        pointer = builder.bitcast(builder.gep(base, [builder.mul(node, word(4))]), four.as_pointer())
        total = builder.fadd(builder.load(pointer, align=_bytes(padded)), row)
        builder.store(total, pointer, align=_bytes(padded))
    return context.get_dummy_value()


def _interleaved(builder: Any, vectors: list[Any]) -> list[list[Any]]:
    """(x, y) and (z, 0) of the even and of the odd lanes within each 128 bits, one instruction each."""
    x, y, z = vectors
    width, each = x.type.count, 128 // (64 if x.type.element == ir.DoubleType() else 32)
    zero = ir.Constant(x.type, [0.0] * width)
    half = each // 2
    orders = [
        [k + at + part * width for k in range(0, width, each) for at in range(begin, begin + half) for part in (0, 1)]
        for begin in (0, half)
    ]
    return [[_shuffled(builder, a, b, order) for a, b in ((x, y), (z, zero))] for order in orders]


def _rows_double(builder: Any, vectors: list[Any]) -> list[Any]:
    """Rows (x, y, z, 0) of each lane."""
    (even, none), (odd, other) = _interleaved(builder, vectors)
    width, rows = vectors[0].type.count, []
    for pair in range(0, width, 2):
        for low, high in ((even, none), (odd, other)):
            rows.append(_shuffled(builder, low, high, [pair, pair + 1, width + pair, width + pair + 1]))
    return rows


def _rows_single(builder: Any, vectors: list[Any]) -> list[Any]:
    """The same in single precision: four rows are transposed within 128 bits."""
    width, rows = vectors[0].type.count, []
    wide = []
    for low, high in _interleaved(builder, vectors):
        for at in (0, 2):
            order = [k + at + part * width + i for k in range(0, width, 4) for part in (0, 1) for i in (0, 1)]
            wide.append(_shuffled(builder, low, high, order))
    for lane in range(width):
        begin = lane // 4 * 4
        none = ir.Constant(wide[0].type, ir.Undefined)
        rows.append(_shuffled(builder, wide[lane % 4], none, list(range(begin, begin + 4))))
    return rows


@_generates(root, lambda vector: vector, Vector)
def _root(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    return _called(builder, "sqrt", *args)


def _called(builder: Any, name: str, *vectors: Any) -> Any:
    """The result of an LLVM function of vectors of one type."""
    kind = vectors[0].type
    name = f"llvm.{name}.v{kind.count}{kind.element.intrinsic_name}"
    function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(kind, [kind] * len(vectors)), name)
    return builder.call(function, vectors)


@_generates(at_least, lambda vector, least: vector, Vector, Vector)
def _at_least(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    return builder.select(builder.fcmp_ordered("<", *args), args[1], args[0])


@_generates(add_product, lambda total, a, b: total, Vector, Vector, Vector)
def _add_product(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    return _called(builder, "fmuladd", args[1], args[2], args[0])


@_generates(
    row_of,
    lambda table, row, count: Vector(table.dtype, count.literal_value) if hasattr(count, "literal_value") else None,
    types.Array,
    types.Integer,
    types.Integer,
)
@_generates(four, lambda padded, row: Vector(padded.dtype, 4), types.Array, types.Integer)
def _row(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    pointer = _row_at(context, builder, signature.args, args, context.get_value_type(signature.return_type))
    return builder.load(pointer, align=_bytes(signature.args[0]))


def _row_at(context: Any, builder: Any, kinds: Any, args: Any, vector: Any) -> Any:
    """Pointer to a row that is a vector."""
    base, word = context.make_array(kinds[0])(context, builder, args[0]).data, context.get_value_type(types.intp)
    row = context.cast(builder, args[1], kinds[1], types.intp)
    return builder.bitcast(builder.gep(base, [builder.mul(row, word(vector.count))]), vector.as_pointer())


@_generates(put_row, lambda vector, table, row: types.void, Vector, types.Array, types.Integer)
def _put_row(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    pointer = _row_at(context, builder, signature.args[1:], args[1:], args[0].type)
    builder.store(args[0], pointer, align=_bytes(signature.args[1]))
    return context.get_dummy_value()


@_generates(doubled, lambda vector: Vector(types.float64, vector.count), Vector)
def _doubled(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    double = context.get_value_type(signature.return_type)
    return args[0] if args[0].type == double else builder.fpext(args[0], double)


@_generates(turned, lambda vector: vector, Vector)
def _turned(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    return _shuffled(builder, args[0], ir.Constant(args[0].type, ir.Undefined), [1, 2, 0, 3])


@_generates(unless, lambda condition, vector: vector, types.Boolean, Vector)
def _unless(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    return builder.select(args[0], ir.Constant(args[1].type, [0.0] * args[1].type.count), args[1])


@_generates(across, lambda vector: vector.real, Vector)
def _across(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    a, b, c, d = (builder.extract_element(args[0], ir.IntType(32)(lane)) for lane in range(4))
    return builder.fadd(builder.fadd(a, b), builder.fadd(c, d))
