"""Views, tuples by address, and vectors of four in compiled code."""

from typing import NamedTuple

import numpy as np
import pytest
from numba.core.errors import TypingError
from scipy.sparse import csr_array

from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import compiled, njit_inlined, njit_lean
from massspring.kernels.jit.flat import BLOCK, any_gap_within, flat
from massspring.kernels.jit.row_sums import copy_scaled, sum_of_areas, sum_of_products, sum_of_scaled, sums_from_origin
from massspring.layout.sell_chunks import along_curve


@njit_lean
def doubled(table, first, last):
    rows = flat(table, first, last)
    for entry in range(rows.shape[0]):
        rows[entry] *= 2
    return rows.shape[0]


@njit_lean
def block_with(gap, begin, reach):
    return any_gap_within(gap, begin, reach)


@pytest.mark.parametrize("real", [np.float64, np.float32, np.uint8])
@pytest.mark.parametrize("shape", [(7,), (7, 3), (7, 4)])
def test_flat_rows_are_those_rows_and_no_copy(shape, real):
    table = np.arange(np.prod(shape), dtype=real).reshape(shape)
    expected = table.copy()
    expected[2:5] *= 2
    assert doubled(table, 2, 5) == expected[2:5].size
    assert np.array_equal(table, expected)
    assert np.array_equal(flat(table, 2, 5), expected[2:5].ravel())
    assert doubled(table, 7, 7) == 0


def test_what_is_not_contiguous_has_no_flat_rows():
    with pytest.raises(TypingError, match="flat"):
        doubled(np.zeros((4, 6))[:, ::2], 0, 4)


@pytest.mark.parametrize("real", [np.float64, np.float32])
@pytest.mark.parametrize("near", [-1.0, 0.25, np.nan])
@pytest.mark.parametrize("where", [0, BLOCK - 1, BLOCK, 2 * BLOCK - 1])
def test_a_block_is_passed_over_only_where_nothing_is_near(where, near, real):
    gap = np.full(2 * BLOCK + 5, 0.5, dtype=real)
    gap[0 if where >= BLOCK else BLOCK] = np.inf
    gap[where] = near
    assert [bool(block_with(gap, begin, 0.25)) for begin in (0, BLOCK)] == [where < BLOCK, where >= BLOCK]
    assert block_with(gap, 2 * BLOCK, 0.25)  # the last one is not full and always looked through


def test_neighbours_in_space_are_neighbours_on_the_curve():
    """4,096 random points of a cube: one step of the curve leads no farther than a few times their spacing 1/16."""
    x = np.random.default_rng(1).uniform(size=(4096, 3))
    place = along_curve(x)
    assert sorted(place) == list(range(4096))
    steps = np.linalg.norm(np.diff(x[np.argsort(place)], axis=0), axis=1)
    assert np.median(steps) < 2 / 16
    assert np.median(np.linalg.norm(np.diff(x, axis=0), axis=1)) > 0.5


def test_points_in_one_place_have_an_order_too():
    assert sorted(along_curve(np.ones((5, 3)))) == list(range(5))


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


def test_a_field_that_is_no_array_or_number_is_named():
    @by_address
    class Wrong(NamedTuple):
        name: str

    with pytest.raises(TypeError, match=r"Wrong\.name"):
        sums(Wrong("x"))


def test_compiled_code_cannot_hand_such_a_tuple_back():
    with pytest.raises(TypeError, match="cannot convert"):
        handed_back(group(np.float64))


MANY = 1e-14
"""Round-off of a sum of some ten terms, over their size."""


@compiled
def scaled_sums(starts, index, value, factor, out):
    for r in range(starts.shape[0] - 1):
        sum_of_scaled(starts[r], starts[r + 1], index, value, factor, 2.5, out, r)


@compiled
def sums_of_products(starts, index, value, field, out):
    for r in range(starts.shape[0] - 1):
        out[r] = sum_of_products(starts[r], starts[r + 1], index, value, field)


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_sums_in_registers(real):
    """Rows of 0 to 6 entries, the last one up to the end of the arrays."""
    random = np.random.default_rng(1)
    starts = np.concatenate([[0], np.cumsum([3, 0, 6, 1, 4])]).astype(np.uint32)
    index = random.integers(0, 9, starts[-1]).astype(np.uint32)
    value, field = (random.normal(size=(size, 4)).astype(real) for size in (len(index), 9))
    factor = random.normal(size=9)
    out = np.ones((5, 4), dtype=real)
    sums = np.ones(5)
    scaled_sums(starts, index, value, factor, out)
    sums_of_products(starts, index, value, field, sums)
    round_off = 10 * float(np.finfo(real).eps)
    matrix = csr_array((np.ones(len(index)), np.arange(len(index)), starts), shape=(5, len(index)))
    assert np.abs(out - 2.5 * matrix @ (factor[index, None] * value)).max() < round_off
    assert np.abs(sums - matrix @ (field[index] * value).sum(axis=1)).max() < round_off


@compiled
def sums_seen_from_the_first(starts, index, value, padded, weight, out):
    for r in range(starts.shape[0] - 1):
        if starts[r] < starts[r + 1]:
            out[r] = sums_from_origin(starts[r], starts[r + 1], index, value, padded, weight)


@compiled
def sums_of_areas(starts, corner, share, padded, out):
    """Each sum, and −3 times it further down."""
    for r in range(starts.shape[0] - 1):
        sum_of_areas(starts[r], starts[r + 1], corner, share, padded, out, r)
        copy_scaled(-3.0, out, r, out, r + 5)


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_what_a_row_says_of_a_volume(real):
    """In double whatever the arrays are, and 1e4 from the origin: differences of such places are exact."""
    random = np.random.default_rng(1)
    starts = np.concatenate([[0], np.cumsum([3, 0, 6, 1, 4])]).astype(np.uint32)
    index = random.integers(0, 9, starts[-1]).astype(np.uint32)
    value, padded = random.normal(size=(len(index), 4)).astype(real), (1e4 + random.normal(size=(9, 4))).astype(real)
    weight = random.uniform(1.0, 2.0, 9).astype(real)
    out = np.zeros((5, 2))
    sums_seen_from_the_first(starts, index, value, padded, weight, out)
    for r in np.flatnonzero(np.diff(starts.astype(int))):
        e = np.arange(starts[r], starts[r + 1])
        away = padded[index[e]].astype(np.float64) - padded[index[e[0]]]
        squares = (value[e].astype(np.float64) ** 2).sum(axis=1)
        exact = (away * value[e]).sum(), (weight[index[e]] * squares).sum()
        assert np.abs(out[r] - exact).max() < 100 * MANY


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_sums_of_the_areas_of_quadrangles(real):
    """Rows of 0 to 6 quadrangles."""
    random = np.random.default_rng(1)
    starts = np.concatenate([[0], np.cumsum([3, 0, 6, 1, 4])]).astype(np.uint32)
    corner = random.integers(0, 9, (starts[-1], 4)).astype(np.uint32)
    share, padded = random.normal(size=len(corner)).astype(real), np.zeros((9, 4), dtype=real)
    padded[:, :3] = random.normal(size=(9, 3))
    out = np.ones((10, 4), dtype=real)
    sums_of_areas(starts, corner, share, padded, out)
    x, row = padded[corner, :3].astype(np.float64), np.repeat(np.arange(5), np.diff(starts.astype(int)))
    exact = np.zeros((5, 3))
    np.add.at(exact, row, share[:, None] * np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]))
    assert np.abs(out[:, :3] - np.vstack([exact, -3.0 * exact])).max() < 300 * float(np.finfo(real).eps)
    assert (out[:, 3] == 0).all()
