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


@dataclass(frozen=True)
class AttributeSpec(Part[V]):
    """A number or text. length: the letter in shapes that it is the length of."""

    length: str


def array(shape: str, kind: str, unit: str, description: str) -> FieldSpec[np.ndarray]:
    """An array that every record has."""
    return FieldSpec(kind, unit, description, False, shape)


def optional_array(shape: str, kind: str, unit: str, description: str) -> FieldSpec[np.ndarray | None]:
    """An array that some records have."""
    return FieldSpec(kind, unit, description, True, shape)


def value(of: type[T], unit: str, description: str, length: str = "") -> AttributeSpec[T]:
    """A number or text that every record has."""
    return AttributeSpec(KINDS[of], unit, description, False, length)


def optional_value(of: type[T], unit: str, description: str) -> AttributeSpec[T | None]:
    """A number or text that some records have."""
    return AttributeSpec(KINDS[of], unit, description, True, "")


def lines_of(table: type[Table], sort: type[P]) -> dict[str, P]:
    """The lines of a table by name, inherited ones first."""
    classes = reversed(table.__mro__)
    return {name: line for each in classes for name, line in vars(each).items() if isinstance(line, sort)}
