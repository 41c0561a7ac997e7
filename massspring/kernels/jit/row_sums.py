"""Four numbers of a sparse row's entry at once: sums along a row in one vector register.

The compiler vectorises loops, not the components of an entry, so these sums are written as vector instructions. The
plain functions define the result and are used when nothing is compiled.
"""

from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic, overload

from massspring.kernels.jit.simd4 import NEXT, Row

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


def sums_from_origin(start, stop, index, value, padded, weight):
    """Σ_e (places_j − places_o) · value_e and Σ_e weight_j |value_e|², j = index_e, o the first of them, in double."""
    products, squares = 0.0, 0.0
    for e in range(start, stop):
        away = padded[index[e]] - padded[index[start]]
        products += float(away.astype(np.float64) @ value[e])
        squares += float(weight[index[e]]) * float(value[e].astype(np.float64) @ value[e])
    return products, squares


def sum_of_areas(start, stop, corner, share, padded, out, place):
    """out_place = Σ_q share_q (x_2 − x_0) × (x_3 − x_1) with padded positions x of the corners (q, 4); `out` (·, 4)."""
    out[place, :] = 0.0
    for q in range(start, stop):
        x = padded[corner[q], :3]
        out[place, :3] += share[q] * np.cross(x[2] - x[0], x[3] - x[1])


def copy_scaled(times, value, row, out, place):
    """out_place = times value_row; both (·, 4)."""
    out[place] = times * value[row]


@intrinsic
def _scaled(
    typingctx: Any, start: Any, stop: Any, index: Any, value: Any, factor: Any, times: Any, out: Any, place: Any
) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        row = Row(context, builder, signature, args, value.dtype)

        def step(e: Any, totals: list[Any]) -> list[Any]:
            return [row.plus(totals[0], row.spread(row.number(4, row.index(2, e))), row.four(3, e))]

        row.put(builder.fmul(row.spread(row.given(5)), row.sums_by_twos(1, step)[0]), 6, args[7])
        return context.get_dummy_value()

    return types.void(types.intp, types.intp, index, value, factor, times, out, types.intp), generate


@intrinsic
def _products(typingctx: Any, start: Any, stop: Any, index: Any, value: Any, field: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        row = Row(context, builder, signature, args, value.dtype)

        def step(e: Any, totals: list[Any]) -> list[Any]:
            return [row.plus(totals[0], row.four(3, e), row.four(4, row.index(2, e)))]

        return row.across(row.sums_by_twos(1, step)[0])

    return value.dtype(types.intp, types.intp, index, value, field), generate


@intrinsic
def _from_origin(typingctx: Any, start: Any, stop: Any, index: Any, value: Any, padded: Any, weight: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        row = Row(context, builder, signature, args, types.float64)
        origin = row.four(4, row.index(2, args[0]))

        def step(e: Any, totals: list[Any]) -> list[Any]:
            j, entry = row.index(2, e), row.widened(row.four(3, e))
            away = row.widened(builder.fsub(row.four(4, j), origin))
            weighed = builder.fmul(row.spread(row.number(5, j)), entry)
            return [row.plus(totals[0], away, entry), row.plus(totals[1], weighed, entry)]

        return context.make_tuple(
            builder, signature.return_type, [row.across(total) for total in row.sums_by_twos(2, step)]
        )

    pair = types.UniTuple(types.float64, 2)
    return pair(types.intp, types.intp, index, value, padded, weight), generate


@intrinsic
def _areas(typingctx: Any, start: Any, stop: Any, corner: Any, share: Any, padded: Any, out: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        row = Row(context, builder, signature, args, padded.dtype)

        def step(q: Any, totals: list[Any]) -> list[Any]:
            x = [row.four(4, row.index(2, q, column)) for column in range(4)]
            a, b = builder.fsub(x[2], x[0]), builder.fsub(x[3], x[1])
            # a × b = (a b' − a' b)', where ' shifts the lanes by one; the outer ' is applied once, after the loop.
            a_next = builder.fmul(row.turned(a, NEXT), b)
            across = builder.fsub(builder.fmul(a, row.turned(b, NEXT)), a_next)
            return [row.plus(totals[0], row.spread(row.number(3, q)), across)]

        row.put(row.turned(row.sums(1, step)[0], NEXT), 5, args[6])
        return context.get_dummy_value()

    return types.void(types.intp, types.intp, corner, share, padded, out, types.intp), generate


@intrinsic
def _copied(typingctx: Any, times: Any, value: Any, at: Any, out: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        row = Row(context, builder, signature, args, value.dtype)
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
def _compiled_from_origin(start, stop, index, value, padded, weight):
    return lambda start, stop, index, value, padded, weight: _from_origin(start, stop, index, value, padded, weight)  # pyright: ignore[reportCallIssue]


@overload(sum_of_areas, jit_options=INLINED)
def _compiled_areas(start, stop, corner, share, padded, out, place):
    return lambda start, stop, corner, share, padded, out, place: _areas(start, stop, corner, share, padded, out, place)  # pyright: ignore[reportCallIssue]


@overload(copy_scaled, jit_options=INLINED)
def _compiled_copy(times, value, row, out, place):
    return lambda times, value, row, out, place: _copied(times, value, row, out, place)  # pyright: ignore[reportCallIssue]
