"""Obstacles only push: no node is held to one, or to one side of a wedge, by a pull (eq. 3.8, 9.2)."""

import numpy as np
import pytest

from massspring import Attachment, Clock, ImplicitVolume, Plane, Setup, Trajectory, surface_body
from massspring.analysis.stability import step_limit
from massspring.kernels.arrays.layout import Push
from massspring.kernels.contact.friction import release_edges
from massspring.kernels.contact.modes import FREE, ON_EDGE, SLIDES
from tests.massspring.active_nodes import list_active
from tests.massspring.conftest import SOFT, icosphere
from tests.massspring.kernels.test_friction import wedge_of

ROUND_OFF = 1e-12  # m/s, of some 0.1


@pytest.fixture(scope="module")
def shell():
    return surface_body(*icosphere(2, 0.05), SOFT)


def there_and_back(plane: Plane, depth: float, duration: float) -> Plane:
    """The plane goes in by `depth` [m] in 0.3 of the time and is back at half time."""
    inwards = tuple(depth * np.array(plane.normal))
    return Plane(
        plane.point, plane.normal, Trajectory((0.0, 0.3 * duration, 0.5 * duration), ((0, 0, 0), inwards, (0, 0, 0)))
    )


@pytest.mark.parametrize("angle", [None, 0.4], ids=["one plane", "a wedge"])
def test_no_obstacle_pulls_a_node(shell, angle):
    """In every step of a run in which planes come and go, a plane pushes each node on it outwards."""
    clock = Clock(0.5 * step_limit(shell).undamped, 1500, 1)
    top = Plane((0, 0, 0.05), (0, 0, -1))
    planes = (top,) if angle is None else wedge_of(0.0, clock.duration, angle)
    held = Attachment(np.flatnonzero(shell.rest[:, 2] * (1 if angle is None else -1) < -0.04))
    planes = tuple(there_and_back(plane, 0.02, clock.duration) for plane in planes)
    setup = Setup(shell, ImplicitVolume(), clock, planes, (held,), damping=10.0)
    state, met = setup.start(), 0
    for frame in range(clock.frames):
        boundary = setup.boundary(frame)
        state = setup.method.advance(state, boundary)
        nodes, contacts, on_one = state.nodes, state.contacts, state.contacts.mode == SLIDES
        push = boundary.dt * state.lam[0] * state.model.inverse_mass[:, None]
        pushed = ((contacts.v_target - nodes.v_star - push * nodes.gradient) * contacts.normal).sum(axis=1)
        met += int(on_one.sum())
        assert (pushed[on_one] > -ROUND_OFF).all(), frame
    assert met > 5000


@pytest.mark.parametrize(("first", "second"), [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)])
def test_a_wedge_lets_go_of_a_node_that_either_side_would_pull(shell, first, second):
    """v_target − u = α n + β n' with α, β given; the normals are neither parallel nor at right angles."""
    setup = Setup(shell, ImplicitVolume(), Clock(1e-3, 1, 1), wedge_of(0.0, 1.0, 0.4))
    state, boundary = setup.start(), setup.boundary(0)
    nodes, contacts, node = state.nodes, state.contacts, int(state.model.surface_nodes[3])
    n, m = (np.array(plane.unit_normal) for plane in setup.obstacles)
    nodes.v_star[node] = (0.1, -0.2, 0.3)
    nodes.gradient[node] = (1e-3, 2e-3, -1e-3)
    lam = 50.0
    u = nodes.v_star[node] + boundary.dt * lam * state.model.inverse_mass[node] * nodes.gradient[node]
    contacts.normal[node], contacts.second_normal[node] = n, m
    contacts.v_target[node] = u + first * n + second * m
    contacts.contact_id[node], contacts.second[node], contacts.mode[node] = 1, 2, ON_EDGE
    list_active(contacts)
    free = first < 0 or second < 0
    assert release_edges(state.model, nodes, contacts, boundary, Push(nodes.gradient, lam)) == int(free)
    assert contacts.mode[node] == (FREE if free else ON_EDGE)
