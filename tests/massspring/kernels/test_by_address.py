"""Named tuples that compiled code is given by their address: every field arrives, and writing to arrays is seen."""

from typing import NamedTuple

import numpy as np
import pytest

from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import compiled, njit_inlined


@by_address
class Inside(NamedTuple):
    """A group in a group."""

    table: np.ndarray
    scale: float


@by_address
class Whole(NamedTuple):
    """One of everything."""

    count: int
    wanted: bool
    inside: Inside
    row: np.ndarray
    part: np.ndarray
    absent: Inside | None = None


class Pair(NamedTuple):
    """A plain tuple that carries one by its address."""

    whole: Whole
    factor: float


@njit_inlined
def scaled(inside, factor):
    return inside.scale * factor * inside.table[1, 2]


@compiled
def handed_back(whole):
    return whole.inside


def group(real, absent=None):
    table = np.arange(12, dtype=real).reshape(3, 4)
    return Whole(3, True, Inside(table, 0.5), np.zeros(5), np.zeros(10)[::2], absent)


@compiled
def sums(whole):
    pair = Pair(whole, 2.0)
    total = whole.count + whole.inside.table.sum() + whole.inside.scale
    if whole.wanted and whole.absent is None:
        total += whole.part.shape[0]
    whole.part[1] = total
    for i in range(whole.row.shape[0]):
        whole.row[i] = scaled(pair.whole.inside, pair.factor)
    return total


@pytest.mark.parametrize("real", [np.float64, np.float32, np.uint32])
def test_every_kind_of_field_arrives_and_arrays_are_written_to(real):
    whole = group(real)
    assert sums(whole) == 3 + 66 + 0.5 + 5
    assert whole.part.tolist() == [0, 74.5, 0, 0, 0]
    assert whole.row.tolist() == [6.0] * 5


def test_fields_of_other_types_are_compiled_apart():
    first = group(np.float64)
    second = first._replace(absent=first.inside, inside=Inside(np.zeros((2, 3)), 1.0))
    assert sums(second) == 3 + 0 + 1.0
    assert sums(first) == 3 + 66 + 0.5 + 5


def test_a_field_that_is_no_array_or_number_is_named():
    @by_address
    class Wrong(NamedTuple):
        name: str

    with pytest.raises(TypeError, match=r"Wrong\.name"):
        sums(Wrong("x"))


def test_compiled_code_cannot_hand_such_a_tuple_back():
    with pytest.raises(TypeError, match="cannot convert"):
        handed_back(group(np.float64))
