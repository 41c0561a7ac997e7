"""The error bar: exact on exact power laws, honest where there is none, and large enough on a converged body."""

import numpy as np
import pytest

from reference_fem import SolveError
from reference_fem.uncertainty import (
    FASTEST,
    NESTED_RATE,
    NESTED_SAFETY,
    NESTED_TWO,
    SAFETY,
    SCATTER,
    SLOWEST,
    TWO_MESHES,
    UNCONFIRMED,
    combined,
    field_error,
    mesh_error,
    nested_error,
    observed_order,
    setting_error,
)

SIZES = (1.0, 1.3, 1.9)
"""Of different ratio: formulas for a constant ratio fail."""


def law(order, limit=7.0, slope=0.3):
    return [limit + slope * h**order for h in SIZES]


@pytest.mark.parametrize("order", [1.0, 1.7, 2.0, 2.9])
@pytest.mark.parametrize("slope", [0.3, -0.02])
def test_a_power_law_is_extrapolated_to_its_limit(order, slope):
    values = law(order, slope=slope)
    error = mesh_error(SIZES, values)
    assert error.order == pytest.approx(order, rel=1e-9)
    assert values[0] + error.shift == pytest.approx(7.0, rel=1e-12)
    assert error.uncertainty == pytest.approx(SAFETY * abs(slope), rel=1e-9)


def test_an_order_that_is_too_low_is_not_believed():
    error = mesh_error(SIZES, law(0.2))
    assert error.order == SLOWEST
    gap = abs(law(0.2)[1] - law(0.2)[0])
    assert error.uncertainty == pytest.approx(SAFETY * gap / (1.3**SLOWEST - 1), rel=1e-12)


@pytest.mark.parametrize("fastest", [1.0, 2.0, FASTEST])
@pytest.mark.parametrize("fine_change", [1e-6, 0.01, 0.05])
def test_a_fine_change_that_is_small_by_chance_makes_no_small_bar(fine_change, fastest):
    """The coarsest mesh is 0.3 (h3^p − 1) off the finest, and what that leaves is the bar."""
    coarse = 7.0 + 0.3 * (1.9**fastest - 1)
    error = mesh_error(SIZES, [7.0, 7.0 + fine_change, coarse], (SLOWEST, fastest))
    assert error.order == fastest
    assert error.shift == pytest.approx(-fine_change / (1.3**fastest - 1), rel=1e-9)
    assert error.uncertainty == pytest.approx(UNCONFIRMED * 0.3, rel=1e-9)


def fast_then_slow(h):
    """Off by h, as next to an outline, and by a part that fills the change of the coarse pair."""
    return 1.0 * h + 0.0075 * h**12


def test_a_fast_change_of_the_coarse_pair_does_not_hide_the_slow_one():
    """The observed order is 3 and its bar smaller than what is left; slower orders that are believed cover it."""
    sizes = (1.0, 1.2, 1.45)
    values = [fast_then_slow(h) for h in sizes]
    field = [SLOPES * value for value in values]
    left = np.sqrt(WEIGHTS @ (SLOPES**2).sum(axis=1)) * values[0]
    assert mesh_error(sizes, values).order == FASTEST
    assert field_error(sizes, field, WEIGHTS).uncertainty < left
    believed = (0.5, 1.0)
    assert 1.2 * values[0] < mesh_error(sizes, values, believed).uncertainty < 6 * values[0]
    assert 1.2 * left < field_error(sizes, field, WEIGHTS, believed).uncertainty < 3 * left


def test_meshes_that_come_together_too_fast_have_a_larger_factor():
    """Errors +2 and −0.1 cancel on the finest pair: their change says nothing of what is left."""
    slow, fast = mesh_error(SIZES, law(2.9)), mesh_error(SIZES, law(3.1))
    assert slow.uncertainty == pytest.approx(SAFETY * 0.3, rel=1e-9)
    assert fast.order == FASTEST
    assert fast.uncertainty > UNCONFIRMED * 0.3


SLOPES, WEIGHTS = np.array([[0.3, -0.1], [0.2, 0.5], [0.0, 0.1]]), np.array([1.0, 4.0, 0.5])


@pytest.mark.parametrize("order", [1.0, 2.0, 2.5])
def test_a_field_has_the_order_of_its_size(order):
    """Each point has a slope of its own; the points' weights decide what its size is."""
    error = field_error(SIZES, [2.0 + SLOPES * h**order for h in SIZES], WEIGHTS)
    left = np.sqrt(WEIGHTS @ (SLOPES**2).sum(axis=1))
    assert error.order == pytest.approx(order, abs=0.01)
    assert error.shift == pytest.approx(left, rel=0.01)
    assert error.uncertainty == pytest.approx(SAFETY * left, rel=0.01)


@pytest.mark.parametrize("order", [1.0, 2.0, 2.5])
@pytest.mark.parametrize("own", [0.5, 1.0, 3.0])
def test_errors_that_each_mesh_has_for_itself_are_separated(order, own):
    """Independent fields on top of a common one, `own` times as large: extrapolation sees the common one alone."""
    noise = np.random.default_rng(5)
    common = noise.normal(size=(3000, 3))
    fields = [1.0 + h**order * (common + own * noise.normal(size=(3000, 3))) for h in SIZES]
    error = field_error(SIZES, fields, np.full(3000, 1 / 9000))
    # 9,000 independent numbers give the order to a few hundredths and sizes to a few per cent.
    assert error.order == pytest.approx(order, abs=0.15)
    assert error.uncertainty == pytest.approx(SAFETY * np.sqrt(1 + own**2), rel=0.1)
    assert error.shift == pytest.approx(1.0, rel=0.25)


def test_fields_that_come_no_closer_have_the_spread():
    fields = [np.zeros((3, 1)), np.full((3, 1), 0.4), np.full((3, 1), 0.1)]
    error = field_error(SIZES, fields, np.full(3, 1 / 3))
    assert error.uncertainty == pytest.approx(SCATTER * 0.4, rel=1e-12)
    assert not error.monotone


def test_values_that_go_to_and_fro_have_the_spread():
    error = mesh_error(SIZES, [3.0, 3.4, 2.9])
    assert not error.monotone
    assert error.shift == 0.0
    assert error.uncertainty == pytest.approx(SCATTER * 0.5, rel=1e-12)
    assert mesh_error(SIZES, [3.0, 2.9, 3.4]).uncertainty == pytest.approx(SCATTER * 0.5, rel=1e-12)
    # Two changes of a series at right angles are no approach either; its ends are then farthest apart.
    turned = mesh_error(SIZES, [np.array([0.0, 0.0]), np.array([3.0, 0.0]), np.array([3.0, 4.0])])
    assert not turned.monotone
    assert turned.uncertainty == pytest.approx(SCATTER * 5.0, rel=1e-12)


def test_two_meshes_have_the_largest_bar():
    """Three times what order one leaves, more than three meshes of any order say."""
    values = law(1.0)
    two = mesh_error(SIZES[:2], values[:2])
    assert two.uncertainty == pytest.approx(TWO_MESHES * 0.3, rel=1e-12)
    assert two.uncertainty > mesh_error(SIZES, values).uncertainty
    field = field_error(SIZES[:2], [np.array([[v]]) for v in values[:2]], np.ones(1))
    assert field.uncertainty == pytest.approx(two.uncertainty, rel=1e-12)


def test_no_change_is_no_error():
    assert mesh_error(SIZES, [2.0, 2.0, 2.0]).uncertainty == 0.0
    assert field_error(SIZES, [np.ones((2, 1))] * 3, np.ones(2)).uncertainty == 0.0
    assert observed_order(SIZES, 0.1, 0.0) == FASTEST
    assert observed_order(SIZES, 0.0, 0.1) == SLOWEST


@pytest.mark.parametrize("sizes", [(1.0, 1.0, 2.0), (2.0, 1.5, 1.0), (1.0,), (0.0, 1.0, 2.0)])
def test_sizes_that_are_no_family_are_refused(sizes):
    with pytest.raises(SolveError, match="meshes of different size"):
        mesh_error(sizes, [1.0, 2.0, 3.0])


def test_broken_values_are_refused():
    with pytest.raises(SolveError, match="not finite"):
        mesh_error(SIZES, [1.0, 2.0, np.nan])


@pytest.mark.parametrize("factor", [2.0, 3.0, 10.0])
def test_a_setting_of_order_one_is_extrapolated_exactly(factor):
    """f = 5 + a/s: the change from s to factor s tells all of a/s."""
    left = 0.3
    assert setting_error(-(left - left / factor), factor) == pytest.approx(left, rel=1e-12)
    with pytest.raises(SolveError, match="above 1"):
        setting_error(0.1, 1.0)


def test_shares_add_as_independent_ones():
    assert combined({"mesh": 3.0, "contact": 4.0, "steps": 0.0}) == pytest.approx(5.0, rel=1e-15)
    assert combined({"mesh": 3.0, "contact": 4.0, "steps": 12.0}) == pytest.approx(13.0, rel=1e-15)
    assert combined({}) == 0.0


UNKNOWNS = (40e3, 15e3, 6e3)
"""Of nested meshes, fine to coarse; of different ratio."""


def changes_of(rate, slope=0.3):
    """From the finest of UNKNOWNS to the others, of values 7 + slope n^-rate with n in thousands."""
    left = [slope * (n / 1e3) ** -rate for n in UNKNOWNS]
    return [abs(other - left[0]) for other in left[1:]], abs(left[0])


@pytest.mark.parametrize("slope", [0.3, -0.02])
def test_nested_meshes_of_the_rate_that_is_taken_have_the_safety_times_their_error(slope):
    changes, error = changes_of(NESTED_RATE, slope)
    assert nested_error(UNKNOWNS, changes) == pytest.approx(NESTED_SAFETY * error, rel=1e-12)
    assert nested_error(UNKNOWNS[:2], changes[:1]) == pytest.approx(NESTED_TWO * error, rel=1e-12)


@pytest.mark.parametrize("rate", [0.65, 0.8, 1.0, 4 / 3])
def test_nested_meshes_of_the_rates_of_theory_are_covered(rate):
    """1 where outlines dominate and 4/3 elsewhere, 0.8 of stored displacements; what is taken is slower."""
    changes, error = changes_of(rate)
    assert error < nested_error(UNKNOWNS, changes) < 6 * error


@pytest.mark.parametrize("fine_change", [0.0, 1e-6, 0.01])
def test_a_fine_change_of_nested_meshes_that_is_small_by_chance_makes_no_small_bar(fine_change):
    coarse = 0.2
    expected = NESTED_SAFETY * coarse / ((UNKNOWNS[0] / UNKNOWNS[2]) ** (2 / 3) - 1)
    assert nested_error(UNKNOWNS, [fine_change, coarse]) == pytest.approx(expected, rel=1e-12)
    large = NESTED_SAFETY * coarse / ((UNKNOWNS[0] / UNKNOWNS[1]) ** (2 / 3) - 1)
    assert nested_error(UNKNOWNS, [-coarse, fine_change]) == pytest.approx(large, rel=1e-12)


@pytest.mark.parametrize(
    ("unknowns", "changes", "words"),
    [
        ((4e3,), (), "two or three"),
        ((4e3, 3e3, 2e3, 1e3), (0.1, 0.2, 0.3), "two or three"),
        ((4e3, 3e3), (0.1, 0.2), "two or three"),
        ((4e3, 3e3), (np.nan,), "two or three"),
        ((4e3, 3e3, 2e3), (0.1, np.inf), "two or three"),
        ((3e3, 4e3), (0.1,), "3000, 4000 unknowns, which do not fall"),
        ((4e3, 3e3, 3e3), (0.1, 0.2), "do not fall"),
    ],
)
def test_nested_meshes_that_are_no_family_are_refused(unknowns, changes, words):
    with pytest.raises(SolveError, match=words):
        nested_error(unknowns, changes)


def test_the_rule_of_nested_meshes_covers_what_was_measured():
    """The clamped ball on 9,186, 22,558 and 45,186 unknowns: 4.2509, 4.2312 and 4.2259 N; true are 4.227 N ± .05 %."""
    bar = nested_error((45_186, 22_558, 9_186), (4.2312 - 4.2259, 4.2509 - 4.2259))
    assert abs(4.2259 - 4.227) + 0.0005 * 4.227 < bar < 0.005 * 4.227
