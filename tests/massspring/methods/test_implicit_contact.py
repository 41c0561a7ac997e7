"""Implicit springs on obstacles: weight, walls, spheres, friction."""

import numpy as np
import pytest

from massspring import (
    Attachment,
    Clock,
    ImplicitSprings,
    Plane,
    Setup,
    Sphere,
    Trajectory,
    Volumes,
    simulate,
    tetrahedral_body,
)
from tests.massspring.conftest import SOFT, block
from tests.massspring.methods.test_implicit_springs import LONG, limit


def test_a_block_on_the_floor_presses_with_its_weight(block_body):
    floor = Plane((0, 0, float(block_body.rest[:, 2].min())), (0, 0, 1))
    dt = LONG * limit(block_body)
    history = simulate(
        Setup(block_body, ImplicitSprings(), Clock(dt, 200, 1), (floor,), gravity=(0, 0, -9.81), damping=2.0)
    )
    assert history.contact_force[-1, 0, 2] == pytest.approx(9.81 * block_body.mass.sum(), rel=1e-6)
    assert history.penetration.max() < 1e-12


def test_what_touches_a_rough_plane_moves_with_it(block_body):
    low, high = block_body.rest[:, 2].min(), block_body.rest[:, 2].max()
    carry = Trajectory((0.0, 1.0, 3.0), ((0, 0, 0), (0, 0, -0.004), (0.01, 0, -0.004)))
    planes = (
        Plane((0, 0, float(high)), (0, 0, -1), carry, "no_slip"),
        Plane((0, 0, float(low)), (0, 0, 1), friction="no_slip"),
    )
    history = simulate(Setup(block_body, ImplicitSprings(), Clock(0.05, 80, 1), planes, damping=5.0))
    assert history.outcome == "finished"
    assert history.contact_force[-1, 0, 0] > 0.02 * abs(history.contact_force[-1, 0, 2])
    assert history.contact_force[-1, :, 0].sum() == pytest.approx(0.0, abs=1e-3 * abs(history.contact_force[-1, 0, 0]))


def test_a_body_between_walls_at_an_angle_lies_on_their_edge(block_body):
    """Pushed by gravity into a corner: each wall carries its share of the weight, nothing enters."""
    low = block_body.rest.min(axis=0)
    walls = (
        Plane((float(low[0]), 0, 0), (1, 0, 0)),
        Plane((0, 0, float(low[2])), (0, 0, 1)),
    )
    gravity = (-5.0, 0.0, -8.0)
    dt = LONG * limit(block_body)
    history = simulate(Setup(block_body, ImplicitSprings(), Clock(dt, 300, 1), walls, gravity=gravity, damping=2.0))
    weight = block_body.mass.sum()
    # A single long step may be 1 % off, its ten passes being cut off; what is missing of one comes with the next.
    force = history.contact_force[-100:].mean(axis=0)
    assert force[0, 0] == pytest.approx(5.0 * weight, rel=1e-3)
    assert force[1, 2] == pytest.approx(8.0 * weight, rel=1e-3)
    assert history.penetration.max() < 1e-6 * block_body.size


def test_a_sphere_presses_and_volumes_are_many(block_body):
    """128 nodal volumes by conjugate gradients, a round probe, long steps."""
    body = tetrahedral_body(*block((4, 4, 3)), SOFT)
    body = body.keeping(Volumes.nodal(body))
    top = float(body.rest[:, 2].max())
    probe = Sphere((0.04, 0.04, top + 0.031), 0.03, Trajectory((0.0, 1.0), ((0, 0, 0), (0, 0, -0.008))))
    floor = np.flatnonzero(body.rest[:, 2] < 0.005)
    setup = Setup(body, ImplicitSprings(), Clock(0.05, 40, 1), (probe,), (Attachment(floor),), damping=5.0)
    history = simulate(setup)
    assert history.outcome == "finished" and history.iterations[:, 1].max() > 0
    assert np.abs(history.volume / body.rest_volumes - 1).max() < 1e-4
    assert history.contact_force[-1, 0, 2] < 0
    assert history.held_force[-1, 0, 2] == pytest.approx(-history.contact_force[-1, 0, 2], rel=0.01)


def sledge(friction, slope: float, steps: int, long: float):
    """A flat block on a plane in gravity that leans by `slope`, steps in explicit limits; with its body and step."""
    body = tetrahedral_body(*block((3, 3, 1), distortion=0.0), SOFT)
    dt = long * limit(body)
    plane = Plane((0, 0, float(body.rest[:, 2].min())), (0, 0, 1), friction=friction)
    setup = Setup(body, ImplicitSprings(), Clock(dt, steps, 1), (plane,), gravity=(slope * 9.81, 0.0, -9.81))
    return body, dt, simulate(setup)


@pytest.mark.parametrize("friction", [0.1, 0.3])
def test_a_block_slides_down_a_slope_by_coulombs_law(friction):
    """Closed form of backward Euler: (slope − mu) g dt² N (N + 1)/2; 3 % for what the block squashes at first."""
    steps = 12
    body, dt, history = sledge(friction, 0.6, steps, 3.0)
    moved = float((body.mass @ (history.final - body.rest))[0] / body.mass.sum())
    assert moved == pytest.approx((0.6 - friction) * 9.81 * dt**2 * steps * (steps + 1) / 2, rel=0.03)
    force = history.contact_force.sum(axis=(0, 1))
    assert -force[0] == pytest.approx(friction * force[2], rel=1e-3)
    assert history.penetration.max() < 1e-12


def test_a_block_rests_on_a_rough_slope():
    """mu > slope: the sole stays, and the plane carries the whole weight, along it too."""
    body, dt, history = sledge(0.9, 0.3, 200, LONG)
    sole = body.rest[:, 2] < body.rest[:, 2].min() + 1e-9
    assert np.abs(history.final - body.rest)[sole].max() < 1e-3  # a twentieth of an edge: single nodes creep
    assert 0.5 * 0.3 * 9.81 * (200 * dt) ** 2 > 0.05  # without friction it would be far away
    weight = 9.81 * body.mass.sum()
    assert history.contact_force[-1, 0, 0] == pytest.approx(-0.3 * weight, rel=0.01)
    assert history.contact_force[-1, 0, 2] == pytest.approx(weight, rel=0.01)


def test_what_slips_stops_when_the_slope_is_gone():
    """A sledge started on a level plane: friction takes mu g from its speed, then holds it."""
    body = tetrahedral_body(*block((3, 3, 1), distortion=0.0), SOFT)
    dt, mu, speed = 0.005, 0.5, 0.2
    plane = Plane((0, 0, float(body.rest[:, 2].min())), (0, 0, 1), friction=mu)
    v = np.tile([speed, 0.0, 0.0], (body.node_count, 1))
    setup = Setup(body, ImplicitSprings(), Clock(dt, 60, 1), (plane,), gravity=(0.0, 0.0, -9.81), velocity=v)
    state, mean = setup.start(), []
    for frame in range(60):
        state = setup.method.advance(state, setup.boundary(frame))
        mean.append(float(body.mass @ state.v[:, 0] / body.mass.sum()))
    # The weight comes to bear as the block squashes: a tenth less friction in the first four steps.
    assert mean[3] == pytest.approx(speed - 4 * dt * mu * 9.81, rel=0.1)
    assert np.abs(mean[-10:]).max() < 0.05 * speed  # it swings on its sole
