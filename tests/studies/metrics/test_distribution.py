"""Medians, ranges and bounds of a population, held to closed forms and to draws from a given distribution."""

import numpy as np
import pytest
from scipy.stats import binom, norm

from studies.metrics.distribution import ENOUGH, distribution

NONE: dict[str, float] = {}


def named(values):
    return {f"m{number:03d}": float(value) for number, value in enumerate(values)}


def test_of_a_hundred_and_one_members():
    summary = distribution(named(np.arange(-50, 51)), NONE)
    assert (summary.count, summary.lost, summary.median) == (101, 0, 0.0)
    assert summary.middle == (-47.5, 47.5)
    # Of |-50| to |50| every number but 0 stands twice: 47.5 splits off five of a hundred and one.
    assert summary.bound == 48.0
    assert (abs(summary.worst), summary.worst_member) == (50.0, "m000")


def test_a_member_without_a_value_is_lost_not_zero():
    summary = distribution({"a": 2.0, "b": float("nan"), "c": 4.0}, {"a": 0.1})
    assert (summary.count, summary.lost, summary.median) == (2, 1, 3.0)
    nothing = distribution({"a": float("nan")}, NONE)
    assert nothing.count == 0 and nothing.lost == 1 and np.isnan(nothing.median) and nothing.worst_member == ""
    assert np.isnan(distribution({"a": 1.0}, NONE).median_interval).all()


def test_references_with_a_bar_of_a_third_of_the_median_error():
    values, floors = named([3.0, -3.0, -3.0, 3.0]), {"m000": 0.9, "m001": 1.0, "m002": 1.1}
    summary = distribution(values, floors)
    assert summary.resolved == 2  # without a floor no error is resolved
    assert summary.floor == 1.1


def test_the_median_s_interval_covers_as_often_as_it_says():
    rng = np.random.default_rng(1)
    hits = 0
    for _ in range(200):
        low, high = distribution(named(rng.normal(1.0, 2.0, 40)), NONE).median_interval
        hits += low <= 1.0 <= high
    # 95 % promised; 200 trials tell 0.95 from 0.88 and from 0.995.
    assert 0.89 <= hits / 200 <= 0.99


def test_the_bound_is_that_of_the_population():
    values = np.random.default_rng(2).normal(0.0, 1.0, 5_000)
    summary = distribution(named(values), NONE)
    assert summary.bound == pytest.approx(norm.ppf(0.975), rel=0.03)
    assert summary.bound_interval[0] < norm.ppf(0.975) < summary.bound_interval[1]
    assert summary.bound_interval[1] - summary.bound_interval[0] < 0.2
    again = named(values[:30])
    assert distribution(again, NONE) == distribution(again, NONE)


def test_the_confidence_of_the_worst_is_wilks_s():
    """The worst of n is above the 95th percentile unless all n are below it."""
    for count in (1, 20, 40, ENOUGH - 1, ENOUGH):
        summary = distribution(named(np.arange(count)), NONE)
        assert summary.confidence == pytest.approx(1.0 - binom.pmf(count, count, 0.95))
        assert (summary.confidence >= 0.95) == (count >= ENOUGH)
