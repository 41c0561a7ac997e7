import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.metrics.timing.statistics import (
    _sign_test_rank,
    disturbance,
    kernel_ns,
    missed,
    percentiles,
    ratio_with_spread,
)


def test_percentiles_are_times_that_frames_took():
    assert percentiles(np.arange(1, 101).reshape(4, 25)) == {"p50": 51, "p95": 96, "p99": 100, "max": 100}


def test_a_deadline_is_missed_only_when_exceeded():
    frame_ns = np.array([[1_000_000, 1_000_001, 2_500_000, 40_000_000]])
    assert missed(frame_ns) == {1.0: 0.75, 2.0: 0.5, 25.0: 0.25, 33.0: 0.25}


def test_kernel_cost_ignores_disturbed_repeats():
    assert kernel_ns(np.array([[10, 900, 30], [800, 20, 31]])) == 20


def test_a_ratio_larger_than_its_spread():
    b = np.full((5, 9), 100.0)
    ratio = ratio_with_spread(b * np.array([1.3, 1.2, 1.25, 1.22, 1.28])[:, None], b)
    assert (ratio.median, ratio.low, ratio.high) == pytest.approx((1.25, 1.2, 1.3), rel=1e-12)
    assert ratio.resolvable
    assert str(ratio) == "1.25 (1.2 to 1.3)"


def test_a_slow_spell_that_hits_both_cancels():
    spell = np.array([1, 1, 7, 1, 3.0])[:, None]
    ratio = ratio_with_spread(spell * np.full((5, 4), 120.0), spell * np.full((5, 4), 100.0))
    assert (ratio.low, ratio.high) == pytest.approx((1.2, 1.2), rel=1e-12)


def test_four_repeats_resolve_nothing_however_clear():
    assert not ratio_with_spread(np.full((4, 3), 200.0), np.full((4, 3), 100.0)).resolvable
    assert ratio_with_spread(np.full((5, 3), 200.0), np.full((5, 3), 100.0)).resolvable


def test_ranks_of_the_sign_test():
    # Table of the confidence interval of a median: n = 5 (1, 0.9375), 8 (2, 0.9297), 20 (6, 0.9586; 7 gives 0.8847)
    expected = {1: (1, 0.0), 5: (1, 0.9375), 8: (2, 0.9296875), 20: (6, 0.958610534667969)}
    for n, (rank, confidence) in expected.items():
        assert _sign_test_rank(n) == (rank, pytest.approx(confidence, abs=1e-12))


def test_equal_contestants_rarely_differ():
    # 2,000 races of two equal contestants with heavy-tailed noise, 7 repeats, confidence 0.984 at rank 1:
    # wrongly resolved 1.6 % of the time; 3 % is six standard deviations of that count away.
    rng = np.random.default_rng(1)
    times = rng.lognormal(sigma=0.5, size=(2000, 2, 7, 5))
    wrong = sum(ratio_with_spread(a, b).resolvable for a, b in times)
    assert 0 < wrong / 2000 < 0.03


def test_repeats_that_cannot_be_paired_are_refused():
    with pytest.raises(StudyError, match="there are 3 and 4"):
        ratio_with_spread(np.ones((3, 2)), np.ones((4, 2)))


@pytest.mark.parametrize(
    ("own", "others", "why"),
    [
        ((9.5, 9.1), 0.09, ""),
        ((9.5, 8.8), 0.0, "the program waited 12 % of a repeat"),
        ((9.5, 9.5), 0.25, "other processes took 25 % of the processors"),
        ((9.5, 5.0), 0.25, "the program waited 50 % of a repeat, other processes took 25 % of the processors"),
        (None, None, ""),
    ],
)
def test_a_timing_is_disturbed_where_a_repeat_waited_or_others_had_the_processors(own, others, why):
    """Two repeats of 10 ns, in two frames of which one waits."""
    cpu_ns = None if own is None else np.array([[1.0, repeat - 1.0] for repeat in own])
    assert disturbance(np.array([[1.0, 9.0], [1.0, 9.0]]), cpu_ns, others) == why
