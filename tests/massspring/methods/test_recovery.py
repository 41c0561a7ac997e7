"""A body with many volumes that comes back from any shape, and why it does not without `recovers`."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import (
    Attachment,
    Clock,
    ImplicitVolume,
    MassSpringError,
    Plane,
    Probe,
    Setup,
    Volumes,
    simulate,
    step_limit,
    tetrahedral_body,
)
from massspring.body.volumes import tetrahedron_volumes
from massspring.methods.families.recovery import MOST, recovery_of
from tests.massspring.conftest import SOFT, hollow_block
from tests.massspring.elements.solids import curved_solid
from tests.massspring.methods.test_methods import clock_for, momentum, thrown
from tests.massspring.methods.test_stress import STARTS, start_of

RECOVERS = ImplicitVolume(recovers=True)
LINE = (np.diag([1, 0, 0]), 0.0)
SIX = {**STARTS, "line": LINE}
BACK = 1e-3
"""Of the size: root-mean-square distance from the shape at rest, turned and moved onto it; 1,000 steps leave less."""


@pytest.fixture(scope="module")
def nodal_ball(filled_ball):
    """Springs without length and a volume at each node."""
    ball = tetrahedral_body(filled_ball.rest, filled_ball.triangles, filled_ball.tetrahedra, SOFT, "cotangent")
    return ball.keeping(Volumes.nodal(ball))


def distance(body, x) -> float:
    """RMS distance of positions from those at rest over the size, after the rigid motion that makes it least."""
    moved, rest = x - x.mean(axis=0), body.rest - body.rest.mean(axis=0)
    u, _, vt = np.linalg.svd(moved.T @ rest)
    turn = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    return float(np.sqrt(((moved @ turn - rest) ** 2).sum(axis=1).mean())) / body.size


def ended(body, start, method=RECOVERS, fraction=0.4, frames=150):
    """The run from a start, damped as the stress scenes are."""
    clock = clock_for(body, frames, 8, fraction=fraction)
    return simulate(Setup(body, method, clock, damping=20.0, positions=start_of(body, *SIX[start])))


@pytest.mark.parametrize("start", SIX)
def test_from_any_start_the_rest_shape_comes_back_with_a_volume_at_every_node(start, nodal_ball):
    history = ended(nodal_ball, start)
    assert history.outcome == "finished"
    assert distance(nodal_ball, history.final) < BACK and history.min_j[-1] > 0.95
    assert np.abs(history.volume[-1] / nodal_ball.rest_volumes - 1).max() < 1e-3
    assert 0 < history.limited_corrections < 8 * 150 / 2


@pytest.mark.parametrize("start", ["mirrored", "scrambled", "line"])
def test_a_quadratic_body_comes_back(start):
    body = curved_solid()
    history = ended(body, start, frames=300)
    assert history.outcome == "finished" and distance(body, history.final) < BACK


def test_without_it_every_volume_is_right_and_the_shape_is_not(nodal_ball):
    """docs/theory.md, section 8: at rest in a fold, tetrahedra inside out, all volumes within the tolerance."""
    history = ended(nodal_ball, "scrambled", ImplicitVolume())
    assert np.abs(history.volume[-1] / nodal_ball.rest_volumes - 1).max() < 1e-4
    assert distance(nodal_ball, history.final) > 20 * BACK and history.min_j[-1] < 0.0
    assert history.kinetic[-1] < 1e-6 * history.kinetic.max()


def test_just_below_its_limit_the_simple_body_is_as_stable(nodal_ball):
    for start in ("mirrored", "scrambled"):
        assert distance(nodal_ball, ended(nodal_ball, start, fraction=0.95, frames=100).final) < BACK
    simple = recovery_of(nodal_ball, (), None).simple.model
    softer = replace(nodal_ball.springs, rest_length=simple.rest_length, stiffness=simple.stiffness)
    plain = replace(nodal_ball, springs=softer, volumes=None, rest_pressure=0.0)
    assert step_limit(plain).undamped > 1.9 * step_limit(nodal_ball).undamped


def test_from_rest_nothing_changes(nodal_ball):
    """Bit for bit, in flight against planes."""
    clock = clock_for(nodal_ball, 8, 10)
    low = nodal_ball.rest[:, 2].min()
    around = {"obstacles": (Plane((0, 0, low), (0, 0, 1)),), "gravity": (0.0, 0.0, -9.81)}
    v = 0.2 * thrown(nodal_ball)
    one, other = (
        simulate(Setup(nodal_ball, method, clock, velocity=v, **around)) for method in (ImplicitVolume(), RECOVERS)
    )
    for name in ("final", "volume", "pressure", "kinetic", "contact_force"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert one.contact_force.any()


def test_on_the_way_back_momentum_is_kept(nodal_ball):
    """Of a flattened ball in flight, into its own springs and beyond, at every frame."""
    setup = Setup(nodal_ball, RECOVERS, clock_for(nodal_ball, 60, 8, 0.4), velocity=thrown(nodal_ball))
    state = setup.start().moved_to(start_of(nodal_ball, *STARTS["flattened"]))
    before = momentum(nodal_ball.mass, state.x, state.v)
    for frame in range(60):
        state = RECOVERS.advance(state, setup.boundary(frame))
        for now, then in zip(momentum(nodal_ball.mass, state.x, state.v), before, strict=True):
            assert np.abs(now - then).max() < 1e-9 * np.abs(then).max()


def test_a_throw_leaves_momentum_and_held_nodes_as_they_are(nodal_ball):
    """On a line there is nothing to push on: after one frame all free nodes are thrown, alike in every run."""
    held, x = np.arange(5), start_of(nodal_ball, *LINE)
    x[held] = nodal_ball.rest[held]
    setup = Setup(nodal_ball, RECOVERS, clock_for(nodal_ball, 1, 1), (), (Attachment(held),), positions=x)
    states = [RECOVERS.advance(setup.start(), setup.boundary(0)) for _ in range(2)]
    np.testing.assert_array_equal(states[0].v, states[1].v)
    assert not states[0].v[held].any()
    setup = Setup(nodal_ball, RECOVERS, clock_for(nodal_ball, 1, 1), positions=start_of(nodal_ball, *LINE))
    v = RECOVERS.advance(setup.start(), setup.boundary(0)).v
    assert np.abs(nodal_ball.mass @ v).max() < 1e-12 * (nodal_ball.mass @ np.abs(v)).max()


def test_held_and_pressed_it_comes_back_and_no_node_is_in_a_plane(nodal_ball):
    low, high = nodal_ball.rest[:, 2].min(), nodal_ball.rest[:, 2].max()
    bottom = np.flatnonzero(nodal_ball.rest[:, 2] < low + 0.012)
    x = nodal_ball.rest.copy()
    free = np.setdiff1d(np.arange(len(x)), bottom)
    x[free] = start_of(nodal_ball, np.zeros((3, 3)), 0.5)[free]
    top = low + 0.9 * (high - low)
    assert x[:, 2].max() < top
    around = {"obstacles": (Plane((0, 0, top), (0, 0, -1)),), "attachments": (Attachment(bottom),)}
    history = simulate(
        Setup(nodal_ball, RECOVERS, clock_for(nodal_ball, 150, 8, 0.4), damping=20.0, positions=x, **around)
    )
    assert history.outcome == "finished" and history.min_j[-1] > 0.5
    np.testing.assert_array_equal(history.final[bottom], nodal_ball.rest[bottom])
    assert history.final[:, 2].max() < top + 1e-9
    assert history.contact_force[-1, 0, 2] < 0.0


def test_wall_and_lumen_come_back():
    """The lumen is left to itself until the wall is back."""
    points, triangles, tetrahedra, lumen = hollow_block()
    body = tetrahedral_body(points, triangles, tetrahedra, SOFT)
    body = body.keeping(Volumes.closed_surfaces(body, {"wall": triangles, "lumen": lumen}))
    history = ended(body, "flattened")
    assert history.outcome == "finished" and distance(body, history.final) < BACK


def test_a_target_is_followed_in_sum_on_the_way(nodal_ball):
    setup = Setup(nodal_ball, RECOVERS, Clock(1e-3, 1, 4), positions=start_of(nodal_ball, *STARTS["stretched"]))
    boundary = setup.boundary(0)
    assert MOST < 3.0  # the start is not taken for one that is back
    state = RECOVERS.advance(setup.start(), boundary._replace(volume_target=1.5 * boundary.volume_target))
    assert state.memory is not None and np.ptp(state.lam) == 0.0
    v = tetrahedron_volumes(state.x, nodal_ball.tetrahedra).sum()
    assert state.diagnostics.limited[0] == 4 and v < 3.0 * nodal_ball.volume


def test_what_it_cannot_do_is_refused(nodal_ball, ball_body):
    clock = clock_for(nodal_ball, 1, 2)
    with pytest.raises(MassSpringError, match="runs in float64 only, it may settle into another shape"):
        Setup(nodal_ball, RECOVERS, clock, precision="float32")
    with pytest.raises(MassSpringError, match=r"does not support thin probes .*: it may settle into another shape"):
        Setup(nodal_ball, RECOVERS, clock, (Probe((0.0, 0.0, 1.0)),))
    with pytest.raises(MassSpringError, match="back when its tetrahedra are, the body has none; fill its mesh"):
        Setup(ball_body, RECOVERS, clock)
