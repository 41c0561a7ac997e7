"""Four numbers of a sparse row's entry at once: sums along a row in one vector register.

The compiler vectorises loops, not the components of an entry, so these sums spell it out. The plain functions say
what they do and serve where nothing is compiled.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload

LANES = 4
NEXT, FIRST = (1, 2, 0, 3), (0, 0, 0, 0)
"""Lanes in another order: (y, z, x, 0) of (x, y, z, 0), and the first one in all."""
INLINED: Any = {"forceinline": True}
"""A call for each row would cost as much as its sum."""


def sum_of_scaled(start, stop, index, value, factor, times, out, place):
    """out_place = times Σ_e factor[index_e] value_e over start ≤ e < stop; `value` (e, 4), `out` (·, 4)."""
    out[place, :] = 0.0
    for e in range(start, stop):
        out[place] += factor[index[e]] * value[e]
    out[place] *= times


def sum_of_products(start, stop, index, value, field):
    """Σ_e field[index_e] · value_e over start ≤ e < stop; `value` (e, 4), `field` (·, 4)."""
    total = 0.0
    for e in range(start, stop):
        total += float(field[index[e]] @ value[e])
    return total


def sums_from_origin(start, stop, index, value, places, weight):
    """Σ_e (places_j − places_o) · value_e and Σ_e weight_j |value_e|², j = index_e, o the first of them, in double."""
    products, squares = 0.0, 0.0
    for e in range(start, stop):
        away = places[index[e]] - places[index[start]]
        products += float(away.astype(np.float64) @ value[e])
        squares += float(weight[index[e]]) * float(value[e].astype(np.float64) @ value[e])
    return products, squares


def sum_of_areas(start, stop, corner, share, places, out, place):
    """out_place = Σ_q share_q (x_2 − x_0) × (x_3 − x_1) with places x of the corners (q, 4); `out` (·, 4)."""
    out[place, :] = 0.0
    for q in range(start, stop):
        x = places[corner[q], :3]
        out[place, :3] += share[q] * np.cross(x[2] - x[0], x[3] - x[1])


def copy_scaled(times, value, row, out, place):
    """out_place = times value_row; both (·, 4)."""
    out[place] = times * value[row]


def _address(builder: Any, kind: Any, array: Any, row: Any) -> Any:
    """Of the first number in `row`, rows of one or of four numbers."""
    width = LANES if kind.ndim == 2 else 1
    return builder.gep(array.data, [builder.mul(row, ir.Constant(row.type, width))])


class _Row:
    """Writes the code of one sum: loads by row of the arrays among the arguments, arithmetic on four numbers."""

    def __init__(self, context: Any, builder: Any, signature: Any, args: Any, real: Any) -> None:
        self.context, self.builder, self.kinds, self.args = context, builder, signature.args, args
        self.arrays = {
            at: context.make_array(kind)(context, builder, arg)
            for at, (kind, arg) in enumerate(zip(signature.args, args, strict=True))
            if isinstance(kind, types.Array)
        }
        self.real = real
        self.vector = ir.VectorType(context.get_value_type(real), LANES)

    def _where(self, at: int, row: Any) -> Any:
        return _address(self.builder, self.kinds[at], self.arrays[at], row)

    def _pointer(self, at: int, row: Any) -> tuple[Any, int]:
        """To four numbers of the array, and what they are aligned to: one number."""
        address = self._where(at, row)
        four = ir.VectorType(address.type.pointee, LANES).as_pointer()
        return self.builder.bitcast(address, four), self.kinds[at].dtype.bitwidth // 8

    def number(self, at: int, row: Any) -> Any:
        """One number, as real as the sum."""
        number = self.builder.load(self._where(at, row))
        return self.context.cast(self.builder, number, self.kinds[at].dtype, self.real)

    def given(self, at: int) -> Any:
        """A number among the arguments, as real as the sum."""
        return self.context.cast(self.builder, self.args[at], self.kinds[at], self.real)

    def index(self, at: int, row: Any, column: int = 0) -> Any:
        """A row number out of an array of uint32."""
        address = self.builder.gep(self._where(at, row), [ir.Constant(row.type, column)])
        return self.builder.zext(self.builder.load(address), row.type)

    def four(self, at: int, row: Any) -> Any:
        """Four numbers, as real as the array."""
        pointer, align = self._pointer(at, row)
        return self.builder.load(pointer, align=align)

    def widened(self, four: Any) -> Any:
        """Four numbers as real as the sum."""
        return four if four.type == self.vector else self.builder.fpext(four, self.vector)

    def put(self, four: Any, at: int, row: Any) -> None:
        """Stores four numbers."""
        pointer, align = self._pointer(at, row)
        self.builder.store(four, pointer, align=align)

    def turned(self, four: Any, order: tuple[int, ...]) -> Any:
        """The lanes in another order."""
        chosen = ir.Constant(ir.VectorType(ir.IntType(32), LANES), list(order))
        return self.builder.shuffle_vector(four, ir.Constant(four.type, ir.Undefined), chosen)

    def spread(self, number: Any) -> Any:
        """One number in all lanes."""
        single = self.builder.insert_element(
            ir.Constant(self.vector, ir.Undefined), number, ir.Constant(ir.IntType(32), 0)
        )
        return self.turned(single, FIRST)

    def plus(self, total: Any, a: Any, b: Any) -> Any:
        """total + a b, rounded once where the machine can."""
        kind = ir.FunctionType(self.vector, [self.vector] * 3)
        name = f"llvm.fmuladd.v{LANES}{self.vector.element.intrinsic_name}"
        return self.builder.call(cgutils.get_or_insert_function(self.builder.module, kind, name), [a, b, total])

    def sums(self, count: int, step: Callable[[Any, list[Any]], list[Any]]) -> list[Any]:
        """`count` totals over the entries start ≤ e < stop, the first two arguments: `step` adds one entry to them."""
        builder, (start, stop) = self.builder, self.args[:2]
        zero = ir.Constant(self.vector, [0.0] * LANES)
        totals = [cgutils.alloca_once_value(builder, zero) for _ in range(count)]
        with cgutils.for_range_slice(builder, start, stop, ir.Constant(start.type, 1)) as (e, _):
            for total, after in zip(totals, step(e, [builder.load(total) for total in totals]), strict=True):
                builder.store(after, total)
        return [builder.load(total) for total in totals]

    def across(self, four: Any) -> Any:
        """The sum of four lanes."""
        a, b, c, d = (self.builder.extract_element(four, ir.Constant(ir.IntType(32), lane)) for lane in range(LANES))
        return self.builder.fadd(self.builder.fadd(a, b), self.builder.fadd(c, d))


@intrinsic
def _scaled(
    typingctx: Any, start: Any, stop: Any, index: Any, value: Any, factor: Any, times: Any, out: Any, place: Any
) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        row = _Row(context, builder, signature, args, value.dtype)

        def step(e: Any, totals: list[Any]) -> list[Any]:
            return [row.plus(totals[0], row.spread(row.number(4, row.index(2, e))), row.four(3, e))]

        row.put(builder.fmul(row.spread(row.given(5)), row.sums(1, step)[0]), 6, args[7])
        return context.get_dummy_value()

    return types.void(types.intp, types.intp, index, value, factor, times, out, types.intp), generate


@intrinsic
def _products(typingctx: Any, start: Any, stop: Any, index: Any, value: Any, field: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        row = _Row(context, builder, signature, args, value.dtype)

        def step(e: Any, totals: list[Any]) -> list[Any]:
            return [row.plus(totals[0], row.four(3, e), row.four(4, row.index(2, e)))]

        return row.across(row.sums(1, step)[0])

    return value.dtype(types.intp, types.intp, index, value, field), generate


@intrinsic
def _from_origin(typingctx: Any, start: Any, stop: Any, index: Any, value: Any, places: Any, weight: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        row = _Row(context, builder, signature, args, types.float64)
        origin = row.four(4, row.index(2, args[0]))

        def step(e: Any, totals: list[Any]) -> list[Any]:
            j, entry = row.index(2, e), row.widened(row.four(3, e))
            away = row.widened(builder.fsub(row.four(4, j), origin))
            weighed = builder.fmul(row.spread(row.number(5, j)), entry)
            return [row.plus(totals[0], away, entry), row.plus(totals[1], weighed, entry)]

        return context.make_tuple(builder, signature.return_type, [row.across(total) for total in row.sums(2, step)])

    pair = types.UniTuple(types.float64, 2)
    return pair(types.intp, types.intp, index, value, places, weight), generate


@intrinsic
def _areas(typingctx: Any, start: Any, stop: Any, corner: Any, share: Any, places: Any, out: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        row = _Row(context, builder, signature, args, places.dtype)

        def step(q: Any, totals: list[Any]) -> list[Any]:
            x = [row.four(4, row.index(2, q, column)) for column in range(4)]
            a, b = builder.fsub(x[2], x[0]), builder.fsub(x[3], x[1])
            # a × b = (a b' − a' b)', the lanes of ' one further; the outer ' waits for the end.
            a_next = builder.fmul(row.turned(a, NEXT), b)
            across = builder.fsub(builder.fmul(a, row.turned(b, NEXT)), a_next)
            return [row.plus(totals[0], row.spread(row.number(3, q)), across)]

        row.put(row.turned(row.sums(1, step)[0], NEXT), 5, args[6])
        return context.get_dummy_value()

    return types.void(types.intp, types.intp, corner, share, places, out, types.intp), generate


@intrinsic
def _copied(typingctx: Any, times: Any, value: Any, at: Any, out: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        row = _Row(context, builder, signature, args, value.dtype)
        row.put(builder.fmul(row.spread(row.given(0)), row.four(1, args[2])), 3, args[4])
        return context.get_dummy_value()

    return types.void(times, value, types.intp, out, types.intp), generate


@overload(sum_of_scaled, jit_options=INLINED)
def _compiled_scaled(start, stop, index, value, factor, times, out, place):
    return lambda start, stop, index, value, factor, times, out, place: _scaled(
        start, stop, index, value, factor, times, out, place
    )  # pyright: ignore[reportCallIssue]


@overload(sum_of_products, jit_options=INLINED)
def _compiled_products(start, stop, index, value, field):
    return lambda start, stop, index, value, field: _products(start, stop, index, value, field)  # pyright: ignore[reportCallIssue]


@overload(sums_from_origin, jit_options=INLINED)
def _compiled_from_origin(start, stop, index, value, places, weight):
    return lambda start, stop, index, value, places, weight: _from_origin(start, stop, index, value, places, weight)  # pyright: ignore[reportCallIssue]


@overload(sum_of_areas, jit_options=INLINED)
def _compiled_areas(start, stop, corner, share, places, out, place):
    return lambda start, stop, corner, share, places, out, place: _areas(start, stop, corner, share, places, out, place)  # pyright: ignore[reportCallIssue]


@overload(copy_scaled, jit_options=INLINED)
def _compiled_copy(times, value, row, out, place):
    return lambda times, value, row, out, place: _copied(times, value, row, out, place)  # pyright: ignore[reportCallIssue]
