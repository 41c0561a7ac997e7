"""A body with many volumes that comes back from any shape, and why it does not without `recovers`."""

import numpy as np
import pytest

from massspring import Attachment, ImplicitVolume, Plane, Setup, Volumes, simulate, tetrahedral_body
from tests.massspring.conftest import SOFT
from tests.massspring.methods.test_implicit_volume import STARTS, start_of
from tests.massspring.methods.test_methods import clock_for, thrown
from tests.massspring.quadratic import curved_solid, mixed_solid

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


@pytest.mark.parametrize(
    ("start", "make"),
    [("mirrored", curved_solid), ("scrambled", curved_solid), ("line", curved_solid), ("mirrored", mixed_solid)],
)
def test_a_quadratic_body_comes_back(start, make):
    body = make()
    history = ended(body, start, frames=300)
    assert history.outcome == "finished" and distance(body, history.final) < BACK


def test_without_it_every_volume_is_right_and_the_shape_is_not(nodal_ball):
    """docs/theory.md, section 8: at rest in a fold, tetrahedra inside out, all volumes within the tolerance."""
    history = ended(nodal_ball, "scrambled", ImplicitVolume())
    assert np.abs(history.volume[-1] / nodal_ball.rest_volumes - 1).max() < 1e-4
    assert distance(nodal_ball, history.final) > 20 * BACK and history.min_j[-1] < 0.0
    assert history.kinetic[-1] < 1e-6 * history.kinetic.max()


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
