"""What is not finite at the start is refused in a sentence; what is moved at the start runs from there."""

import numpy as np
import pytest

from massspring import (
    Attachment,
    Clock,
    Free,
    ImplicitVolume,
    MassSpringError,
    Plane,
    Ramp,
    Setup,
    Sphere,
    Trajectory,
    make_clock,
    simulate,
    step_limit,
)
from tests.massspring.methods.test_methods import clock_for


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
    options = {name: spoiled if isinstance(value, str) else value for name, value in changes.items()}
    with pytest.raises(MassSpringError, match=words):
        Setup(block_body, Free(), clock_for(block_body, 1, 1), **options)


@pytest.mark.parametrize(
    ("method", "words"),
    [
        (ImplicitVolume(most_iterations=-1), "most_iterations is -1; give a whole number from 0 on, such as 200"),
        (ImplicitVolume(most_iterations=2.5), "most_iterations is 2.5; give a whole number"),
        (ImplicitVolume(tolerance="x"), "tolerance is 'x'; give a finite number from 0 on, such as 1e-06"),
        (ImplicitVolume(tolerance=np.nan), "tolerance is nan; give a finite number"),
        (ImplicitVolume(tolerance=True), "tolerance is True; give a finite number"),
    ],
)
def test_settings_that_no_method_can_use_are_refused(block_body, method, words):
    with pytest.raises(MassSpringError, match=words):
        Setup(block_body, method, clock_for(block_body, 1, 1))


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ((-0.005, 2, 3), "a frame takes -0.005 s"),
        ((0.0, 2, 3), "a frame takes 0.0 s"),
        ((np.nan, 2, 3), "a frame takes nan s"),
        ((0.01, 2.5, 3), "frames = 2.5"),
        ((0.01, 2, 0), "steps = 0; give a whole number from 1 on"),
    ],
)
def test_a_clock_that_cannot_run_is_refused(numbers, words):
    with pytest.raises(MassSpringError, match=words):
        Clock(*numbers)


def test_a_duration_without_end_is_refused(block_body):
    with pytest.raises(MassSpringError, match="3 frames in inf s"):
        make_clock(np.inf, 3, "auto", step_limit(block_body))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"damping": -5.0}, "damping is -5.0 1/s; it must be zero or positive"),
        ({"damping": np.nan}, "damping is nan 1/s"),
        ({"held_nodes": np.array([-1])}, "nodes are numbered from 0 to"),
        ({"held_nodes": np.array([10**6])}, "nodes are numbered from 0 to"),
    ],
)
def test_no_limit_of_the_step_is_given_for_impossible_numbers(block_body, options, words):
    with pytest.raises(MassSpringError, match=words):
        step_limit(block_body, **options)


@pytest.mark.parametrize("nodes", [np.array([0.5, 1.9]), np.array([True, False, True])])
def test_nodes_of_an_attachment_are_whole_numbers(block_body, nodes):
    setup = Setup(block_body, Free(), clock_for(block_body, 1, 1), attachments=(Attachment(nodes),))
    with pytest.raises(MassSpringError, match=f"the nodes of attachment 0 are {nodes.dtype}; give whole numbers"):
        setup.start()


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_paths_and_obstacles_that_are_not_finite_are_refused(wrong):
    for make in (
        lambda: Trajectory((0.0, 1.0), ((0, 0, 0), (0, 0, wrong))),
        lambda: Trajectory((0.0, wrong), ((0, 0, 0), (0, 0, 1))),
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


def test_a_target_that_nothing_would_read_is_refused(block_body):
    """Springs alone keep no volume: a run that never fills would look like one that does."""
    with pytest.raises(
        MassSpringError, match="volume 'whole', which method 'free' does not follow: it keeps no volume; leave it out"
    ):
        Setup(block_body, Free(), clock_for(block_body, 1, 1), targets={"whole": Ramp((0.0, 1e3), (1.0, 1.1))})
