"""Sums four numbers at a time equal those of NumPy."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from massspring.kernels.jit.decorators import compiled
from massspring.kernels.jit.row_sums import copy_scaled, sum_of_areas, sum_of_products, sum_of_scaled, sums_from_origin

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
