"""The plain code makes the motion of quadratic bodies, so that only speed is compared."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Clock, ImplicitVolume, Plane, Setup, Trajectory, quadratic_body, simulate, step_limit
from studies.bench import plain_points
from tests.massspring.conftest import SOFT
from tests.massspring.quadratic import curved_block


@pytest.fixture(scope="module")
def swinging() -> Setup:
    """A block that is stretched and sheared by its first speeds."""
    body = quadratic_body(*curved_block(), SOFT)
    field = np.array([[1.0, 0.5, 0.0], [0.0, -0.5, 0.3], [0.2, 0.0, -0.5]])
    clock = Clock(4.0 * step_limit(body).undamped, 10, 8)
    return Setup(body, ImplicitVolume(), clock, velocity=2.0 * body.rest @ field.T, damping=1.0)


@pytest.mark.campaign
def test_the_plain_step_makes_the_same_motion(swinging):
    history = simulate(swinging)
    _, x = plain_points.plain_points_run(swinging)
    moved = np.abs(history.final - swinging.body.rest).max()
    assert history.outcome == "finished" and moved > 0.05 * swinging.body.size
    assert np.abs(x - history.final).max() < 1e-4 * moved


def test_a_missing_term_would_show(swinging, monkeypatch):
    softer = replace(swinging, body=replace(swinging.body, local_bulk=0.0))
    _, x = plain_points.plain_points_run(softer)
    final = simulate(swinging).final
    assert np.abs(x - final).max() > 1e-3 * np.abs(final - swinging.body.rest).max()


def test_planes_press(swinging):
    body = swinging.body
    top, end = body.rest[:, 2].max() + 1e-4, swinging.clock.duration
    plane = Plane((0.0, 0.0, top), (0.0, 0.0, -1.0), Trajectory((0.0, end), ((0.0, 0.0, 0.0), (0.0, 0.0, -1e-3))))
    _, x = plain_points.plain_points_run(replace(swinging, obstacles=(plane,), velocity=None))
    assert x[:, 2].max() <= top - 1e-3 + 1e-12
