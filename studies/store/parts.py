"""Lines of the tables of records (studies.store.schema): what a part is and, of one record, its value with its type.

A table is a class whose lines are class variables: `RunFields.t` is the line, `RunFields(…).t` the array.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar, overload

import numpy as np

from studies.base.errors import StudyError

NUMBER, INDEX, TEXT = "number", "whole number", "text"
KINDS: dict[type, str] = {float: NUMBER, int: INDEX, str: TEXT}
DTYPES = {NUMBER: "fiu", INDEX: "iu", TEXT: "U"}
TYPES = {NUMBER: (int, float), INDEX: (int,), TEXT: (str,)}
"""The numpy kinds of arrays, and the Python types of single values."""
V = TypeVar("V")
T = TypeVar("T", float, int, str)
P = TypeVar("P", bound="Part")


class Table:
    """The parts of one record. owner: the record in words; values: name -> value, of those that are there."""

    def __init__(self, owner: str, values: Mapping[str, Any]) -> None:
        self._owner, self._values = owner, values


@dataclass(frozen=True)
class Part(Generic[V]):
    """What stands under a name. optional: may be left out of a record, or None there."""

    kind: str
    unit: str
    description: str
    optional: bool
    name: str = field(init=False, default="")

    def __set_name__(self, owner: type, name: str) -> None:
        object.__setattr__(self, "name", name)

    @overload
    def __get__(self: P, table: None, owner: type) -> P: ...

    @overload
    def __get__(self, table: Table, owner: type) -> V: ...

    def __get__(self, table: Table | None, owner: type) -> Any:
        """Raises StudyError for what must be there and is not: nothing was computed, or the file is an older one."""
        if table is None:
            return self
        value = table._values.get(self.name)
        if value is None and not self.optional:
            raise StudyError(f"{table._owner} holds no {self.name!r}")
        return value


@dataclass(frozen=True)
class FieldSpec(Part[V]):
    """An array. shape: lengths as letters (schema.LENGTHS) or numbers, with blanks between."""

    shape: str

    def fault(self, fields: Mapping[str, Any], lengths: dict[str, int]) -> str | None:
        """What is wrong with it among `fields` (name -> anything with `values` and `unit`), as the end of a sentence.
        The first use of a letter adds its length to `lengths`."""
        if self.name not in fields:
            return None if self.optional else f"lacks {self.name!r}"
        values, unit = np.asarray(fields[self.name].values), fields[self.name].unit
        if values.dtype.kind not in DTYPES[self.kind]:
            return f"holds {self.name!r} as {values.dtype}, not as {self.kind}s"
        if unit != self.unit:
            return f"holds {self.name!r} in {unit!r}, not in {self.unit!r}"
        letters = self.shape.split()
        if values.ndim != len(letters):
            shape = [lengths.get(x, x) for x in letters]
        else:
            pairs = zip(letters, values.shape, strict=True)
            shape = [int(x) if x.isdigit() else lengths.setdefault(x, n) for x, n in pairs]
            if tuple(shape) == values.shape:
                return None
        return f"holds {self.name!r} with shape ({_row(values.shape)}), not ({_row(shape)})"


@dataclass(frozen=True)
class AttributeSpec(Part[V]):
    """A number or text. length: the letter in shapes that it is the length of."""

    length: str

    def fault(self, attributes: Mapping[str, Any]) -> str | None:
        """What is wrong with it among `attributes`, as the end of a sentence."""
        value = attributes.get(self.name)
        if value is None:
            return None if self.optional else f"lacks the attribute {self.name!r}"
        value = value.item() if isinstance(value, np.generic) else value
        if isinstance(value, bool) or not isinstance(value, TYPES[self.kind]):
            return f"has {self.name} = {str(value)[:40]!r}, not a {self.kind}"
        return None


def _row(lengths: Any) -> str:
    return ", ".join(map(str, lengths))


def array(shape: str, kind: str, unit: str, description: str) -> FieldSpec[np.ndarray]:
    return FieldSpec(kind, unit, description, False, shape)


def optional_array(shape: str, kind: str, unit: str, description: str) -> FieldSpec[np.ndarray | None]:
    return FieldSpec(kind, unit, description, True, shape)


def value(of: type[T], unit: str, description: str, length: str = "") -> AttributeSpec[T]:
    return AttributeSpec(KINDS[of], unit, description, False, length)


def optional_value(of: type[T], unit: str, description: str) -> AttributeSpec[T | None]:
    return AttributeSpec(KINDS[of], unit, description, True, "")


def lines_of(table: type[Table], sort: type[P]) -> dict[str, P]:
    """The lines of a table by name, inherited ones first."""
    classes = reversed(table.__mro__)
    return {name: line for each in classes for name, line in vars(each).items() if isinstance(line, sort)}
