"""What haptic updates and frames wait for: whole steps, as many as keep simulated time up with wall time."""

import numpy as np
import pytest

from massspring import Clock, Free, MassSpringError, Setup, simulate
from studies.bench.line import BenchLine
from studies.bench.slide import counted_ns, steps_of_updates, stepwise, updates_ns, waited_ns
from tests.massspring.probe.test_probe import BALL, pressed

DT = 1.5e-3


def test_updates_take_turns_between_one_step_and_two():
    """Each 2 ms of 1.5 ms steps: 2 (3 ms are simulated), 1 (4.5), 1 (6), and so on."""
    assert steps_of_updates(8, DT, 2e-3).tolist() == [2, 1, 1, 2, 1, 1]
    assert steps_of_updates(4, DT, DT).tolist() == [1, 1, 1, 1]
    assert steps_of_updates(9, DT, 3 * DT).tolist() == [3, 3, 3]
    assert steps_of_updates(5, 2e-3, 1e-3).tolist() == [1, 0] * 5  # a step serves two


@pytest.mark.parametrize("dt", [1 / 30 / 19, 1.5e-3, 0.7e-3])
def test_simulated_time_is_never_behind_and_less_than_a_step_ahead(dt):
    steps = steps_of_updates(1000, dt, 2e-3)
    ahead = np.cumsum(steps) * dt - 2e-3 * np.arange(1, len(steps) + 1)
    assert ahead.min() > -1e-9 * dt and ahead.max() < dt
    assert 1000 - steps.sum() <= np.ceil(2e-3 / dt)  # the rest is less than an update


def test_an_update_waits_for_its_steps():
    step_ns = np.array([[1.0, 2.0, 4.0, 8.0, 16.0], [5.0, 5.0, 5.0, 5.0, 5.0]])
    # Beginning with the first step: 1 + 2, 4, 8; with the second: 2 + 4, 8, 16.
    assert updates_ns(step_ns, DT, 2e-3).tolist() == [[3, 4, 8, 6, 8, 16], [10, 5, 5, 10, 5, 5]]
    assert updates_ns(step_ns, DT, DT).tolist() == step_ns.tolist()


def test_every_frame_is_timed_and_a_run_that_breaks_off_is_none():
    setup = pressed(Free(), frames=3)
    assert (waited_ns(setup) > 0).tolist() == [True] * 3
    assert (waited_ns(stepwise(setup)) > 0).tolist() == [True] * 3 * setup.clock.steps
    # The same steps, but for the round-off of their times.
    assert np.abs(simulate(stepwise(setup)).final - simulate(setup).final).max() < 1e-9 * BALL.size
    thrown = np.random.default_rng(0).normal(size=BALL.rest.shape)
    with pytest.raises(MassSpringError, match="broke off while it was timed"):
        waited_ns(Setup(BALL, Free(), Clock(0.5, 200, 1), velocity=thrown))


def test_a_line_is_judged_by_its_target_or_not_at_all():
    assert BenchLine("p99", 1.0, "ms", 2.0).verdict == "yes" and BenchLine("p99", 3.0, "ms", 2.0).verdict == "NO"
    faster = BenchLine("times faster", 1.5, "1", 1.6, at_most=False)
    assert faster.verdict == "NO" and faster.promise == ">= 1.6"
    limit = BenchLine("the machine", 1e9, "ms")
    assert limit.verdict == limit.promise == ""
    assert faster.words.split() == ["NO", "1.5", "1", ">=", "1.6", "times", "faster"]
    assert limit.words.split() == ["1e+09", "ms", "the", "machine"]


def test_the_loop_beside_the_steps_does_the_same_each_time():
    times = counted_ns(20)
    assert times.shape == (20,) and times.min() > 1e5  # 25,000 turns take more than 0.1 ms
