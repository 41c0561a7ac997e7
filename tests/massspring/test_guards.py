"""What is not finite stops a run with its frame and a reason; what is not finite at the start never runs."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from massspring import (
    METHODS,
    Attachment,
    Free,
    ImplicitVolume,
    MassSpringError,
    Method,
    Path,
    Plane,
    Ramp,
    Setup,
    Sphere,
    simulate,
)
from massspring.methods.base import begin_frame
from tests.massspring.test_methods import clock_for, squeeze

FRAMES = 10
LOST_AFTER = 3.5
"""Frames of a clock after which what is broken has no place any more."""


@dataclass(frozen=True)
class Broken(Path):
    """A path that was made elsewhere and ends in NaN."""

    until: float = 0.0

    def __call__(self, t):
        where = super().__call__(t)
        return np.where(np.asarray(t)[..., None] > self.until, np.nan, where)


@pytest.fixture(params=METHODS, ids=lambda method: method.name)
def method(request, kept_body):
    chosen = request.param()
    if chosen.applies(kept_body):
        pytest.skip(chosen.applies(kept_body))
    return chosen


def stops(setup, reason: str, good: int):
    """Runs, and checks that it ends diverged in the frame after `good` with NaN tails and the reason in its message."""
    history = simulate(setup)
    assert history.outcome == "diverged"
    assert history.good_frames == good
    assert f"frame {good + 1} " in history.message and reason in history.message
    assert np.isfinite(history.volume[:good]).all() and np.isnan(history.volume[good:]).all()
    assert np.isfinite(history.final).all()
    return history


def test_an_obstacle_that_loses_its_place_stops_the_run(kept_body, method):
    """Comparisons with NaN are false: without the guard the obstacle would just be gone."""
    clock = clock_for(kept_body, FRAMES, 10, method=method)
    path = Broken(until=LOST_AFTER * clock.frame)
    below = Plane((0, 0, kept_body.rest[:, 2].min()), (0, 0, 1), path)
    stops(Setup(kept_body, method, clock, (below,), damping=20.0), "obstacle 0 is no longer finite", 3)


def test_an_attachment_that_loses_its_place_stops_the_run(kept_body, method):
    clock = clock_for(kept_body, FRAMES, 10, method=method)
    held = Attachment(np.array([0]), Broken(until=LOST_AFTER * clock.frame))
    stops(Setup(kept_body, method, clock, (), (held,)), "attachment 0 is no longer finite", 3)


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning", "ignore:invalid:RuntimeWarning")
@pytest.mark.parametrize("speed", [1e200, 1e308])
def test_numbers_that_overflow_stop_the_run(kept_body, method, speed):
    """One node shot off at a speed whose square, or whose way within a step, is no number any more."""
    v = np.zeros_like(kept_body.rest)
    v[3] = [speed, 0.0, 0.0]
    clock = clock_for(kept_body, FRAMES, 10)
    planes = squeeze(kept_body, 0.002, clock.duration)
    stops(Setup(kept_body, method, clock, planes, damping=5.0, velocity=v), "", 0)


@dataclass(frozen=True)
class Poisoned(Method):
    """Springs whose forces turn into NaN, or pressures, from the fourth frame on."""

    what: str
    frames: list

    name: ClassVar[str] = "poisoned"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None

    def advance(self, state, drive):
        self.frames.append(1)
        after = Free().advance(state, drive)
        if len(self.frames) < 4:
            return after
        if self.what == "pressure":
            return replace(after, lam=np.full_like(after.lam, np.nan))
        poisoned = after.motion._replace(v=np.full_like(after.v, np.nan))
        return Free().advance(replace(after, motion=poisoned), drive)


@pytest.mark.parametrize(("what", "reason"), [("force", "positions are no longer"), ("pressure", "pressures are no")])
def test_nan_inside_a_frame_stops_the_run(block_body, what, reason):
    stops(Setup(block_body, Poisoned(what, []), clock_for(block_body, FRAMES, 5)), reason, 3)


def test_nan_in_one_node_ends_every_solve(kept_body, method):
    """Whatever iterates must end on NaN: an iteration that waits for a small residual would wait for ever."""
    setup = Setup(kept_body, method, clock_for(kept_body, 1, 3))
    state = begin_frame(setup.start(), setup.drive(0))
    state.motion.x[4] = np.nan
    assert not np.isfinite(method.advance(state, setup.drive(0)).x).all()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"gravity": (0.0, 0.0, float("nan"))}, "gravity is .*; give three finite numbers"),
        ({"gravity": (0.0, 9.81)}, "gravity is .*; give three finite numbers"),
        ({"velocity": np.zeros((3, 3))}, r"initial velocities have shape \(3, 3\); the body has"),
        ({"positions": np.zeros((3, 3))}, r"initial positions have shape \(3, 3\); the body has"),
        ({"velocity": "nan"}, "initial velocities are not finite at node 7 and 0 more"),
        ({"positions": "nan"}, "initial positions are not finite at node 7 and 0 more"),
    ],
)
def test_what_is_not_finite_at_the_start_is_refused(block_body, changes, words):
    spoiled = np.zeros_like(block_body.rest)
    spoiled[7, 1] = np.nan
    given = {name: spoiled if isinstance(value, str) else value for name, value in changes.items()}
    with pytest.raises(MassSpringError, match=words):
        Setup(block_body, Free(), clock_for(block_body, 1, 1), **given)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_paths_and_obstacles_that_are_not_finite_are_refused(wrong):
    for make in (
        lambda: Path((0.0, 1.0), ((0, 0, 0), (0, 0, wrong))),
        lambda: Path((0.0, wrong), ((0, 0, 0), (0, 0, 1))),
        lambda: Plane((0, 0, wrong), (0, 0, 1)),
        lambda: Plane((0, 0, 0), (0, 0, wrong)),
        lambda: Sphere((0, wrong, 0), 0.1),
        lambda: Sphere((0, 0, 0), wrong),
        lambda: Ramp((0.0,), (wrong,)),
    ):
        with pytest.raises(MassSpringError):
            make()


def test_a_start_away_from_rest_is_where_the_run_starts(ball_body):
    """Moved and turned as a whole it stays so: nothing pulls it back."""
    moved = ball_body.rest[:, [1, 2, 0]] + [0.1, 0.0, 0.0]
    setup = Setup(ball_body, ImplicitVolume(), clock_for(ball_body, 2, 5), positions=moved)
    assert np.array_equal(setup.start().x, moved)
    assert np.abs(simulate(setup).final - moved).max() < 1e-13


def test_an_obstacle_is_looked_for_where_the_body_starts(ball_body):
    ball = Sphere((0.3, 0.0, 0.0), 0.01)
    clock = clock_for(ball_body, 1, 1)
    Setup(ball_body, Free(), clock, (ball,))
    with pytest.raises(MassSpringError, match=r"obstacle 0 starts .* inside the body"):
        Setup(ball_body, Free(), clock, (ball,), positions=ball_body.rest + np.array([0.3, 0.0, 0.0]))
