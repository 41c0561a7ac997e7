"""Rest stays at rest, over many steps."""

import numpy as np
import pytest

from massspring import Clock, ImplicitVolume, Setup, simulate, step_limit, surface_body
from tests.massspring.conftest import SOFT, icosphere


@pytest.mark.parametrize("steps", [20_000, pytest.param(1_000_000, marks=pytest.mark.campaign)])
def test_a_ball_at_rest_stays_there(steps):
    """Round-off is not pumped up: it wanders by 2e-14 of the body in a million steps; a bias of one last digit a step
    would give 1e-10."""
    body = surface_body(*icosphere(1), SOFT)
    dt = 0.5 * step_limit(body).undamped
    history = simulate(Setup(body, ImplicitVolume(), Clock(steps // 10 * dt, 10, steps // 10)))
    assert history.outcome == "finished"
    assert np.abs(history.final - body.rest).max() < 1e-12 * body.size
    assert np.abs(history.volume / body.rest_volumes - 1).max() < 1e-13
    assert history.kinetic[-1] < 1e-20 * SOFT.shear_modulus * body.volume
