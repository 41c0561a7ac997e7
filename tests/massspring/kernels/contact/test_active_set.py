"""The rules of contact node by node, against the geometry of obstacles and dense 3 × 3 solves (eq. 3.7, 3.8, 9.1,
9.2)."""

from typing import Any

import numpy as np
import pytest

from massspring import Capsule, Clock, ImplicitVolume, Plane, Setup, Sphere, Trajectory, surface_body
from massspring.kernels.arrays.layout import Push
from massspring.kernels.contact.active_set import find_contacts, pressure_reach, revise_contacts
from massspring.kernels.contact.friction import release_edges
from massspring.kernels.contact.node_contact import FREE, ON_EDGE, SLIDES, STICKS
from tests.massspring.conftest import SOFT, icosphere, list_active
from tests.massspring.kernels.contact.test_obstacles import wedge_of

DT = 1e-3
LAM = 40.0
ROUND_OFF = 1e-12
"""m, of places of some centimetres, and m/s, of some metres per second."""
ALONG = Trajectory((0.0, 1.0), ((0.0, 0.0, 0.0), (1.3, -0.7, 0.4)))
FLOOR, WALL = Plane((0.0, 0.0, -0.0501), (0.0, 0.0, 1.0)), Plane((-0.0501, 0.0, 0.0), (1.0, 0.0, 0.0))
ABOVE = (-0.02, -0.02, -0.0500), (0.02, 0.02, -0.0475)
OBSTACLES: dict[str, tuple[tuple, tuple]] = {
    "a floor": ((FLOOR,), ABOVE),
    "a sphere": ((Sphere((0.0, 0.0, -0.0702), 0.02),), ABOVE),
    "a corner": (
        (Plane((0.0, 0.0, -0.0505), (0.0, 0.05, 1.0)), WALL),
        ((-0.050, -0.02, -0.050), (-0.0475, 0.02, -0.0475)),
    ),
    "two spheres": (
        (Sphere((0.0195, 0.001, -0.0702), 0.02), Sphere((-0.0195, 0.0, -0.0702), 0.02)),
        ((-0.003, -0.003, -0.066), (0.003, 0.003, -0.062)),
    ),
    "a rod on a floor": (
        (Plane((0, 0, -0.0687), (0, 0, 1)), Capsule((-0.04, 0.001, -0.0602), (0.04, -0.001, -0.0602), 0.01)),
        ((-0.02, 0.003, -0.0687), (0.02, 0.008, -0.0665)),
    ),
    "almost one plane": ((FLOOR, Plane((0.0, 0.0, -0.0501), (0.005, 0.0, 1.0))), ABOVE),
}
"""Obstacles, and the box above or between them in which nodes fly about."""


@pytest.fixture(scope="module")
def shell():
    return surface_body(*icosphere(3, 0.05), SOFT)


class Scene:
    """Nodes close above obstacles fly about: some would enter them within the step, and pressure pushes any way."""

    def __init__(self, shell, obstacles, box=ABOVE) -> None:
        self.obstacles = obstacles
        setup = Setup(shell, ImplicitVolume(), Clock(DT, 1, 1), obstacles)
        state, self.boundary = setup.start(), setup.boundary(0)
        self.state, self.model, random = state, state.model, np.random.default_rng(4)
        self.contacts = state.contacts
        self.nodes = self.model.surface_nodes.astype(np.int64)
        self.state.nodes.x[:] = random.uniform(*box, self.x.shape)
        self.state.nodes.v_star[:] = 2.0 * random.normal(size=self.x.shape)
        size = 1.0 / (DT * LAM * self.model.inverse_mass[:, None])
        self.state.nodes.gradient[:] = 2.0 * size * random.normal(size=self.x.shape)

    @property
    def x(self) -> np.ndarray:
        return self.state.nodes.x

    def free_velocity(self, lam: float) -> np.ndarray:
        """u (n, 3) [m/s]."""
        return self.state.nodes.v_star + DT * lam * self.model.inverse_mass[:, None] * self.state.nodes.gradient

    def velocity(self, lam: float) -> np.ndarray:
        """v⁺ = P u + v_target (n, 3) [m/s] (eq. 3.4, 3.5)."""
        contacts, u = self.contacts, self.free_velocity(lam)
        kept = {
            FREE: u,
            SLIDES: u - (u * contacts.normal).sum(axis=1)[:, None] * contacts.normal,
            ON_EDGE: (u * contacts.direction).sum(axis=1)[:, None] * contacts.direction,
            STICKS: 0 * u,
        }
        return np.choose(contacts.mode[:, None], list(kept.values())) + np.where(
            contacts.mode[:, None] > FREE, contacts.v_target, 0.0
        )

    def gaps(self, y: np.ndarray) -> np.ndarray:
        """(obstacles, n) [m] at the end of the step."""
        return np.array([obstacle.gap(y, DT) for obstacle in self.obstacles])

    def find(self, lam: float = LAM) -> "Scene":
        push = Push(self.state.nodes.gradient, lam)
        find_contacts(self.model, self.state.nodes, self.contacts, self.boundary, 0, push)
        return self

    def revise(self, lam: float, earlier: float = LAM) -> int:
        square = (self.state.nodes.gradient**2).sum(axis=1)
        mobility = float(self.model.inverse_mass @ square)
        reach = pressure_reach(lam - earlier, mobility, self.model.largest_inverse_mass, DT)
        push = Push(self.state.nodes.gradient, lam)
        return revise_contacts(self.model, self.state.nodes, self.contacts, self.boundary, 0, push, reach)


def slopes(obstacle: Any, y: np.ndarray) -> np.ndarray:
    """Outward normals of an obstacle at y (n, 3), by central differences of its gap: good to 1e-6."""
    step = 1e-6 * np.eye(3)
    normals = np.stack([(obstacle.gap(y + e, DT) - obstacle.gap(y - e, DT)) / 2e-6 for e in step], axis=1)
    return normals / np.linalg.norm(normals, axis=1)[:, None]


@pytest.mark.parametrize("name", OBSTACLES)
def test_nodes_sit_on_the_obstacle_that_they_would_enter_deepest(shell, name):
    scene = Scene(shell, *OBSTACLES[name]).find()
    gaps = scene.gaps(scene.x + DT * scene.free_velocity(LAM))
    inner = np.setdiff1d(np.arange(len(scene.x)), scene.nodes)
    away = scene.contacts.mode == FREE
    assert np.abs(scene.contacts.predicted_gap - gaps.min(axis=0))[away].max() < ROUND_OFF
    assert (scene.contacts.predicted_gap[~away] == np.inf).all()
    expected = np.where(gaps.min(axis=0) < 0, gaps.argmin(axis=0) + 1, 0)
    expected[inner] = 0
    assert (scene.contacts.contact_id == expected).all() and len(np.unique(expected)) == len(scene.obstacles) + 1
    one = np.flatnonzero(scene.contacts.mode == SLIDES)
    ends = scene.gaps(scene.x + DT * scene.velocity(LAM))[expected[one] - 1, one]
    assert np.abs(ends).max() < ROUND_OFF  # also beside a rod: no node here comes near its ends


@pytest.mark.parametrize("change", [30.0, -30.0])
def test_a_new_pressure_finds_the_one_node_that_it_moves(shell, change):
    """The reach is as far as a node goes that has all of the gradient, but for a share of round-off, 1e-4; near the
    end of its way there is a floor."""
    scene = Scene(shell, OBSTACLES["a floor"][0])
    node = int(np.argmax(scene.model.inverse_mass * np.isin(np.arange(len(scene.x)), scene.nodes)))
    scene.state.nodes.v_star[:], scene.state.nodes.gradient[:] = 0.0, 0.0
    scene.state.nodes.gradient[node, 2] = -np.sign(change) * 3e-5
    fall = -DT * (scene.free_velocity(LAM + change) - scene.free_velocity(LAM))[node, 2]
    mobility = float(scene.model.inverse_mass @ (scene.state.nodes.gradient**2).sum(axis=1))
    reach = pressure_reach(change, mobility, scene.model.inverse_mass[node], DT)
    assert 0 < fall < reach < 1.001 * fall
    scene.state.nodes.x[node, 2] = FLOOR.point[2] + 0.9 * fall - DT * scene.free_velocity(LAM)[node, 2]
    assert (
        scene.find().contacts.predicted_gap[node] == pytest.approx(0.9 * fall, rel=1e-6)
        and not scene.contacts.mode.any()
    )
    assert scene.revise(LAM + change) == 1 and scene.contacts.mode[node] == SLIDES


@pytest.mark.parametrize("name", ["a floor", "a sphere"])
@pytest.mark.parametrize("way", [(1.5, 0.2, 1.0), (-1.0, 2.5, -1.0, 1.0), (0.0, 1.2, 3.0)])
def test_revised_contacts_are_those_of_the_new_pressure(shell, name, way):
    """Pulled nodes are let go, free ones that would enter sit down; so is a node that was let go before."""
    scene, changed, again = Scene(shell, *OBSTACLES[name]).find(), 0, 0
    release_all = np.zeros(len(scene.x), dtype=bool)
    for lam in LAM * np.array(way):
        held = scene.contacts.mode == SLIDES
        u = scene.free_velocity(lam)
        pulled = held & (((scene.contacts.v_target - u) * scene.contacts.normal).sum(axis=1) < 0)
        enters = ~held & (scene.gaps(scene.x + DT * u)[0] < 0)
        enters[np.setdiff1d(np.arange(len(u)), scene.nodes)] = False
        count = scene.revise(lam)
        assert count == pulled.sum() + enters.sum()
        assert np.array_equal(scene.contacts.mode == SLIDES, (held & ~pulled) | enters)
        changed, again, release_all = changed + count, again + (enters & release_all).sum(), release_all | pulled
    assert changed > 10 and again > 0


@pytest.mark.parametrize("friction", [0.5, 1.5])
@pytest.mark.parametrize("name", ["a floor", "a sphere"])
def test_slip_loses_what_coulomb_says(shell, name, friction):
    """On a moving obstacle: v⁺ = w + s max(0, 1 − mu p/|s|) along it, p what it pushes by."""
    (still,), _ = OBSTACLES[name]
    smooth, rough = (Scene(shell, (type(still)(*_shape(still), ALONG, mu),)).find() for mu in (0.0, friction))
    on = np.flatnonzero(smooth.contacts.mode == SLIDES)
    n, u = smooth.contacts.normal[on], smooth.free_velocity(LAM)[on]
    p = ((smooth.contacts.v_target[on] - u) * n).sum(axis=1)
    w = np.array(ALONG.displacements[1])
    slip = u - w - ((u - w) * n).sum(axis=1)[:, None] * n
    left = np.maximum(0.0, 1 - friction * p / np.linalg.norm(slip, axis=1))
    across = (smooth.contacts.v_target[on] * n).sum(axis=1)[:, None] * n
    expected = w - (n @ w)[:, None] * n + left[:, None] * slip + across
    assert np.abs(rough.velocity(LAM)[on] - expected).max() < ROUND_OFF
    assert np.array_equal(rough.contacts.mode[on] == STICKS, left == 0)
    assert 0 < (left == 0).sum() < len(on), "all of them slip, or none"


def _shape(obstacle) -> tuple:
    return (obstacle.point, obstacle.normal) if isinstance(obstacle, Plane) else (obstacle.centre, obstacle.radius)


def test_what_sticks_too_hard_at_the_new_pressure_slips(shell):
    """k = v⁺ − u is what sticking takes; of its part along the obstacle mu times the other is left (eq. 9.1)."""
    mu, lam = 1.2, 0.4 * LAM
    scene = Scene(shell, (Plane((0, 0, -0.0501), (0, 0, 1), ALONG, mu),)).find()
    sticks = np.flatnonzero(scene.contacts.mode == STICKS)
    u = scene.free_velocity(lam)[sticks]
    k, n = scene.contacts.v_target[sticks] - u, scene.contacts.normal[sticks]
    p = (k * n).sum(axis=1)
    aside = k - p[:, None] * n
    shear = np.linalg.norm(aside, axis=1)
    pushed, slips = p > 0, (p > 0) & (shear > mu * p)
    scene.revise(lam)
    locked = scene.contacts.mode[sticks]
    assert np.array_equal(locked == SLIDES, slips) and np.array_equal(locked == STICKS, pushed & ~slips)
    expected = u + p[:, None] * n + (mu * p / shear)[:, None] * aside
    assert np.abs(scene.velocity(lam)[sticks] - expected)[slips].max() < ROUND_OFF
    assert slips.sum() > 3 and (pushed & ~slips).sum() > 3 and (~pushed).sum() > 3


@pytest.mark.parametrize("name", [name for name, several in OBSTACLES.items() if len(several[0]) == 2])
def test_between_two_obstacles_nodes_keep_both(shell, name):
    """n·v⁺ as at the first alone, m·v⁺ up to the second, free along n × m; without an edge the first counts."""
    obstacles, box = OBSTACLES[name]
    scene, on_edge = Scene(shell, obstacles, box).find(), 0
    for first, second in ((0, 1), (1, 0)):
        alone = Scene(shell, (obstacles[first],), box).find()
        on = np.flatnonzero(scene.contacts.contact_id == first + 1)
        v = alone.velocity(LAM)
        y = alone.x + DT * v
        n, gap = alone.contacts.normal[on], obstacles[second].gap(y, DT)[on]
        m = slopes(obstacles[second], y[on])
        edge = np.cross(n, m)
        both = (gap < 0) & (np.linalg.norm(edge, axis=1) > 0.01)
        assert np.array_equal(scene.contacts.mode[on] == ON_EDGE, both)
        new = scene.velocity(LAM)[on]
        assert np.abs(new - v[on])[~both].max(initial=0.0) < ROUND_OFF
        for k in np.flatnonzero(both):
            right = [n[k] @ v[on[k]], m[k] @ v[on[k]] - gap[k] / DT, edge[k] @ v[on[k]]]
            expected = np.linalg.solve(np.array([n[k], m[k], edge[k]]), right)
            assert np.abs(new[k] - expected).max() < 1e-4  # normals are known to 1e-6, edges as short as 0.01
            assert scene.contacts.second[on[k]] == second + 1
        on_edge += both.sum()
    assert on_edge == 0 if name == "almost one plane" else on_edge > 3


def test_a_node_that_slides_fast_round_a_sphere_is_not_between_it_and_itself(shell):
    """Its normal turns by more than counts as parallel within the step, and it ends on the sphere but for round-off."""
    far = Sphere((0.0, 0.0, 1.0), 0.02)
    scene = Scene(shell, (*OBSTACLES["a sphere"][0], far))
    scene.state.nodes.v_star[:, :2] += 3.0
    scene.find()
    assert (scene.contacts.mode == SLIDES).sum() > 10 and not (scene.contacts.mode == ON_EDGE).any()


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
