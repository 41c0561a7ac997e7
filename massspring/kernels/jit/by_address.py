"""Named tuples that are passed to compiled code by address.

Passed by value, a tuple of sixty arrays is four hundred arguments of every call, and takes most of the compile time. An
address is one number, and a function reads the fields that it uses. In Python, and with the compiler off, the tuples do
not change; compiled code cannot create them.
"""

import hashlib
from collections.abc import Iterator
from typing import Any, TypeVar

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.typing.templates import AttributeTemplate
from numba.core.typing.typeof import typeof_impl
from numba.extending import NativeValue, infer_getattr, lower_getattr_generic, register_model, unbox
from numba.np.numpy_support import as_dtype

Tuple = TypeVar("Tuple", bound=type)

WORD = 8
"""Size of a number, an address or a length [bytes]."""
NUMBERS = {types.float64: -1, types.int64: -2, types.boolean: -3}
"""Code for how a number is read from its Python object; for an array the code is its item size [bytes], which is
positive."""
DEPTH = 4
"""Deepest nesting of tuples."""
WHOLE, BYTE, ADDRESS = ir.IntType(64), ir.IntType(8), cgutils.voidptr_t


class ByAddress(types.Type):
    """The type of such a tuple: its class and the types of its fields.

    places: offset [bytes] and type of each field; size: of all fields together [bytes]
    """

    def __init__(self, tuple_type: type, fields: list[types.Type]) -> None:
        self.tuple_type, self.fields, self.size = tuple_type, tuple(fields), 0
        self.places: dict[str, tuple[int, types.Type]] = {}
        for name, field in zip(tuple_type._fields, fields, strict=True):  # pyright: ignore[reportAttributeAccessIssue]
            self.places[name] = self.size, field
            self.size += _size(tuple_type, name, field)
        words = "\0".join((tuple_type.__module__, *map(str, fields)))
        super().__init__(f"{tuple_type.__name__}.{hashlib.sha256(words.encode()).hexdigest()[:12]}")

    def leaves(self, path: tuple[int, ...] = (), begin: int = 0) -> Iterator[tuple[int, ...]]:
        """For each number and array: DEPTH indices that lead to it, -1 where unused; its offset [bytes]; the code for
        how it is read."""
        for index, (place, field) in enumerate(self.places.values()):
            here = *path, index
            if isinstance(field, ByAddress):
                yield from field.leaves(here, begin + place)
            elif field is not types.none:
                how = _item_size(field) if isinstance(field, types.Array) else NUMBERS[field]
                yield *here, *(-1 for _ in range(DEPTH - len(here))), begin + place, how


def by_address(tuple_type: Tuple) -> Tuple:
    """Decorates a named tuple of arrays, numbers, None and other such tuples."""

    @typeof_impl.register(tuple_type)
    def type_of(value: Any, context: Any) -> ByAddress:
        return ByAddress(type(value), [typeof_impl(item, context) for item in value])

    return tuple_type


def _item_size(array: types.Array) -> int:
    return as_dtype(array.dtype).itemsize


def _size(tuple_type: type, name: str, field: types.Type) -> int:
    if isinstance(field, types.Array):
        return (5 + 2 * field.ndim) * WORD
    if isinstance(field, ByAddress):
        return field.size
    if field in NUMBERS or field is types.none:
        return 0 if field is types.none else WORD
    raise TypeError(
        f"{tuple_type.__name__}.{name} is of type {field}; by address go arrays, numbers, None and such tuples"
    )


register_model(ByAddress)(models.OpaqueModel)


@infer_getattr
class _Fields(AttributeTemplate):
    key = ByAddress

    def generic_resolve(self, value: Any, attr: str) -> Any:
        place = value.places.get(attr)
        return None if place is None else place[1]


@lower_getattr_generic(ByAddress)
def _field(context: Any, builder: Any, group: Any, address: Any, name: str) -> Any:
    place, field = group.places[name]
    if isinstance(field, ByAddress):
        return _at(builder, address, place, BYTE)
    if field is types.none:
        return context.get_dummy_value()
    if not isinstance(field, types.Array):
        number = _read(builder, address, place, context.get_data_type(field))
        return builder.trunc(number, ir.IntType(1)) if field is types.boolean else number
    array = context.make_array(field)(context, builder)
    kind = context.get_data_type(field.dtype).as_pointer()
    numbers = [_read(builder, address, place + WORD * at, WHOLE) for at in range(5, 5 + 2 * field.ndim)]
    array.meminfo, array.parent = (cgutils.get_null_value(part.type) for part in (array.meminfo, array.parent))
    array.nitems = _read(builder, address, place + 2 * WORD, WHOLE)
    array.itemsize = WHOLE(_item_size(field))
    array.data = _read(builder, address, place + 4 * WORD, kind)
    array.shape = cgutils.pack_array(builder, numbers[: field.ndim])
    array.strides = cgutils.pack_array(builder, numbers[field.ndim :])
    return array._getvalue()


def _at(builder: Any, address: Any, place: int, kind: Any) -> Any:
    """Pointer to a value of type `kind`, `place` bytes after `address`."""
    return builder.bitcast(builder.gep(address, [WHOLE(place)]), kind.as_pointer())


def _read(builder: Any, address: Any, place: int, kind: Any) -> Any:
    """Loads the value, marked as invariant: compiled code never changes a field, so a loop need not read it again after
    a store."""
    value = builder.load(_at(builder, address, place, kind))
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value


@unbox(ByAddress)
def _gathered(group: Any, value: Any, c: Any) -> NativeValue:
    """Address of a buffer with the contents of a Python tuple, valid during a call."""
    builder, kind = c.builder, ir.ArrayType(WHOLE, DEPTH + 2)
    rows = [ir.Constant(kind, [WHOLE(number) for number in row]) for row in group.leaves()]
    table = ir.Constant(ir.ArrayType(kind, len(rows)), rows)
    table = builder.bitcast(cgutils.global_constant(builder, f".leaves.{group.name}", table), ADDRESS)
    room = builder.bitcast(cgutils.alloca_once(builder, ir.ArrayType(WHOLE, group.size // WORD)), ADDRESS)
    failed = builder.call(_gather(builder.module), [value, table, WHOLE(len(rows)), room])
    with builder.if_then(failed, likely=False):
        c.pyapi.err_set_string(
            "PyExc_TypeError", f"{group.tuple_type.__name__}: an array is not of the type it is meant to be"
        )
    # Hides the address, so that the compiler does not move reads before the buffer is filled.
    hidden = builder.asm(ir.FunctionType(ADDRESS, [ADDRESS]), "", "=r,0,~{memory}", [room], side_effect=True)
    return NativeValue(hidden, is_error=failed)


def _gather(module: Any) -> Any:
    """The LLVM function that fills the buffer: (tuple, leaves, number of leaves, buffer) -> whether an array has the
    wrong type."""
    flag, real, code = ir.IntType(1), ir.DoubleType(), ir.IntType(32)
    kind = ir.FunctionType(flag, [ADDRESS, ADDRESS, WHOLE, ADDRESS])
    function = cgutils.get_or_insert_function(module, kind, "gather_leaves")
    if function.blocks:
        return function
    function.linkage = "internal"
    builder = ir.IRBuilder(function.append_basic_block())

    def call(name: str, result: Any, *args: Any) -> Any:
        kind = ir.FunctionType(result, [arg.type for arg in args])
        return builder.call(cgutils.get_or_insert_function(module, kind, name), args)

    def is_read(how: int, least: str = "==") -> Any:
        return builder.if_then(builder.icmp_signed(least, numbers[-1], WHOLE(how)))

    whole, table, count, begin = function.args
    failed = cgutils.alloca_once_value(builder, flag(0))
    item = cgutils.alloca_once(builder, ADDRESS)
    with cgutils.for_range(builder, count) as loop:
        row = builder.gep(table, [builder.mul(loop.index, WHOLE(WORD * (DEPTH + 2)))])
        numbers = [builder.load(_at(builder, row, WORD * column, WHOLE)) for column in range(DEPTH + 2)]
        builder.store(whole, item)
        for index in numbers[:DEPTH]:
            with builder.if_then(builder.icmp_signed(">=", index, WHOLE(0))):
                builder.store(call("PyTuple_GetItem", ADDRESS, builder.load(item), index), item)
        value, target = builder.load(item), builder.gep(begin, [numbers[DEPTH]])
        with is_read(NUMBERS[types.float64]):
            builder.store(call("PyFloat_AsDouble", real, value), _at(builder, target, 0, real))
        with is_read(NUMBERS[types.int64]):
            builder.store(call("PyLong_AsLongLong", WHOLE, value), _at(builder, target, 0, WHOLE))
        with is_read(NUMBERS[types.boolean]):
            builder.store(builder.trunc(call("PyObject_IsTrue", code, value), BYTE), target)
        with is_read(0, ">"):
            wrong = builder.icmp_signed("!=", call("numba_adapt_ndarray", code, value, target), code(0))
            size = builder.load(_at(builder, target, 3 * WORD, WHOLE))
            wrong = builder.or_(wrong, builder.icmp_signed("!=", size, numbers[-1]))
            builder.store(builder.or_(builder.load(failed), wrong), failed)
    builder.ret(builder.load(failed))
    return function
