"""What damping against the world takes from a slow motion (eq. 3.1)."""

import numpy as np
import pytest

from massspring import ImplicitVolume, Plane, Setup, Trajectory, quadratic_body, simulate
from tests.massspring.conftest import SOFT
from tests.massspring.methods.test_methods import clock_for
from tests.massspring.quadratic import curved_block

SPEED = 0.02


@pytest.mark.parametrize("inertia", ["lumped", "stiffness"])
@pytest.mark.parametrize("damping", [20.0, 40.0])
def test_a_pushed_body_is_dragged_by_its_mass_and_speed(inertia, damping):
    """c M U in the mean, however the mass is shared among the nodes."""
    body = quadratic_body(*curved_block(), SOFT, inertia=inertia)
    clock = clock_for(body, 60, 40, 0.8)
    way = ((0.0, 0.0, 0.0), (0.0, 0.0, SPEED * clock.duration))
    below = Plane((0.0, 0.0, body.rest[:, 2].min()), (0.0, 0.0, 1.0), Trajectory((0.0, clock.duration), way))
    history = simulate(Setup(body, ImplicitVolume(), clock, (below,), damping=damping))
    force = history.contact_force[history.t > 0.5 * clock.duration, 0, 2]
    assert force.mean() == pytest.approx(damping * body.mass.sum() * SPEED, rel=0.02)
    assert np.abs(history.volume / body.rest_volumes - 1.0).max() < ImplicitVolume.volume_tol
