"""Code generator for sums over entries of four numbers: loads, arithmetic and stores of one vector register."""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

SIMD_WIDTH = 4
NEXT = (1, 2, 0, 3)
"""Lanes in another order: (y, z, x, 0) of (x, y, z, 0)."""


def _address(builder: Any, kind: Any, array: Any, row: Any) -> Any:
    """Address of the first number in `row`; rows have one or four numbers."""
    width = SIMD_WIDTH if kind.ndim == 2 else 1
    return builder.gep(array.data, [builder.mul(row, ir.Constant(row.type, width))])


def spread_over(builder: Any, number: Any, vector: Any) -> Any:
    """One number in all lanes of a vector type."""
    none = ir.Constant(vector, ir.Undefined)
    single = builder.insert_element(none, number, ir.Constant(ir.IntType(32), 0))
    first = ir.Constant(ir.VectorType(ir.IntType(32), vector.count), [0] * vector.count)
    return builder.shuffle_vector(single, none, first)


def plus(builder: Any, total: Any, a: Any, b: Any) -> Any:
    """total + a b lane by lane, rounded once where the machine can."""
    vector = total.type
    name = f"llvm.fmuladd.v{vector.count}{vector.element.intrinsic_name}"
    kind = ir.FunctionType(vector, [vector] * 3)
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), [a, b, total])


class Row:
    """Generates the code of one sum: loads of rows from array arguments, arithmetic on four numbers."""

    def __init__(self, context: Any, builder: Any, signature: Any, args: Any, real: Any) -> None:
        self.context, self.builder, self.kinds, self.args = context, builder, signature.args, args
        self.arrays = {
            at: context.make_array(kind)(context, builder, arg)
            for at, (kind, arg) in enumerate(zip(signature.args, args, strict=True))
            if isinstance(kind, types.Array)
        }
        self.real = real
        self.vector = ir.VectorType(context.get_value_type(real), SIMD_WIDTH)

    def _where(self, at: int, row: Any) -> Any:
        return _address(self.builder, self.kinds[at], self.arrays[at], row)

    def _pointer(self, at: int, row: Any) -> tuple[Any, int]:
        """Pointer to four numbers of an array, and their alignment, that of one number."""
        address = self._where(at, row)
        four = ir.VectorType(address.type.pointee, SIMD_WIDTH).as_pointer()
        return self.builder.bitcast(address, four), self.kinds[at].dtype.bitwidth // 8

    def number(self, at: int, row: Any) -> Any:
        """One number of an array, in the precision of the sum."""
        number = self.builder.load(self._where(at, row))
        return self.context.cast(self.builder, number, self.kinds[at].dtype, self.real)

    def given(self, at: int) -> Any:
        """A scalar argument, in the precision of the sum."""
        return self.context.cast(self.builder, self.args[at], self.kinds[at], self.real)

    def index(self, at: int, row: Any, column: int = 0) -> Any:
        """A row index from an array of uint32."""
        address = self.builder.gep(self._where(at, row), [ir.Constant(row.type, column)])
        return self.builder.zext(self.builder.load(address), row.type)

    def four(self, at: int, row: Any) -> Any:
        """Four numbers in the precision of the array."""
        pointer, align = self._pointer(at, row)
        return self.builder.load(pointer, align=align)

    def widened(self, four: Any) -> Any:
        """Four numbers in the precision of the sum."""
        return four if four.type == self.vector else self.builder.fpext(four, self.vector)

    def put(self, four: Any, at: int, row: Any) -> None:
        """Stores four numbers."""
        pointer, align = self._pointer(at, row)
        self.builder.store(four, pointer, align=align)

    def turned(self, four: Any, order: tuple[int, ...]) -> Any:
        """The lanes in another order."""
        chosen = ir.Constant(ir.VectorType(ir.IntType(32), SIMD_WIDTH), list(order))
        return self.builder.shuffle_vector(four, ir.Constant(four.type, ir.Undefined), chosen)

    def spread(self, number: Any) -> Any:
        """One number in all lanes."""
        return spread_over(self.builder, number, self.vector)

    def plus(self, total: Any, a: Any, b: Any) -> Any:
        """total + a b, rounded once where the machine can."""
        return plus(self.builder, total, a, b)

    def sums(self, count: int, step: Callable[[Any, list[Any]], list[Any]]) -> list[Any]:
        """`count` totals over the entries start ≤ e < stop, the first two arguments: `step` adds one entry to them."""
        builder, (start, stop) = self.builder, self.args[:2]
        zero = ir.Constant(self.vector, [0.0] * SIMD_WIDTH)
        totals = [cgutils.alloca_once_value(builder, zero) for _ in range(count)]
        with cgutils.for_range_slice(builder, start, stop, ir.Constant(start.type, 1)) as (e, _):
            for total, after in zip(totals, step(e, [builder.load(total) for total in totals]), strict=True):
                builder.store(after, total)
        return [builder.load(total) for total in totals]

    def sums_by_twos(self, count: int, step: Callable[[Any, list[Any]], list[Any]]) -> list[Any]:
        """`sums` for rows of many entries, two entries at a time: half as many iterations, and two independent sums."""
        builder, (start, stop) = self.builder, self.args[:2]
        zero, one = ir.Constant(self.vector, [0.0] * SIMD_WIDTH), ir.Constant(start.type, 1)
        even = [cgutils.alloca_once_value(builder, zero) for _ in range(count)]
        odd = [cgutils.alloca_once_value(builder, zero) for _ in range(count)]
        left = builder.and_(builder.sub(stop, start), one)
        with builder.if_then(builder.icmp_signed("<", start, stop)):
            # The last entry of an odd count is computed without a branch, since the processor would mispredict it.
            alone = builder.icmp_signed("==", left, one)
            for total, first in zip(even, step(start, [zero] * count), strict=True):
                builder.store(builder.select(alone, first, zero), total)
        with cgutils.for_range_slice(builder, builder.add(start, left), stop, ir.Constant(start.type, 2)) as (e, _):
            for totals, at in ((even, e), (odd, builder.add(e, one))):
                for total, after in zip(totals, step(at, [builder.load(total) for total in totals]), strict=True):
                    builder.store(after, total)
        return [builder.fadd(builder.load(a), builder.load(b)) for a, b in zip(even, odd, strict=True)]

    def across(self, four: Any) -> Any:
        """The sum of four lanes."""
        a, b, c, d = (
            self.builder.extract_element(four, ir.Constant(ir.IntType(32), lane)) for lane in range(SIMD_WIDTH)
        )
        return self.builder.fadd(self.builder.fadd(a, b), self.builder.fadd(c, d))
