"""The pass over 64 nodes side by side, against the plain kernels and finite differences."""

import numpy as np
import pytest

from massspring import Attachment, Body, Clock, Free, ImplicitVolume, Setup, tetrahedral_body
from massspring.body.springs import Springs
from massspring.kernels.constraint.one_volume import multiplier_of_sums, volume_multiplier
from massspring.kernels.contact.node_contact import ON_EDGE, SLIDES, STICKS
from massspring.kernels.forces.springs import add_membrane_forces, spring_forces_into
from massspring.kernels.forces.volume import volume_gradient_into
from massspring.kernels.step.begin import prescribe
from massspring.layout.allocate import start
from massspring.layout.sell_chunks import LONGEST, rings
from tests.massspring.conftest import SOFT, block, gather_and_predict, icosphere, list_active
from tests.massspring.kernels.forces.test_forces import DIFFERENCE, STEP, moved

ROUND_OFF = 1e-14  # relative to the largest: sums of at most some hundred doubles in another order


def gathered(body: Body, x: np.ndarray, keeps: bool = True, held: tuple[int, ...] = ()):
    """The state after one pass at positions `x` with some velocities, the drive, and (V, G·v*, G·W·G)."""
    clock = Clock(0.01, 1, 10)
    attached = (Attachment(np.array(held)),) if held else ()
    setup = Setup(body, ImplicitVolume(), clock, attachments=attached, gravity=(0.3, 1.0, -9.81), damping=7.0)
    state, boundary = start(body, attached), setup.boundary(0)
    state.nodes.x[:] = x
    state.nodes.v[:] = np.random.default_rng(4).normal(size=x.shape)
    return state, boundary, gather_and_predict(state.model, state.nodes, state.work, boundary, keeps)


def predicted(net, v: np.ndarray, force: np.ndarray, boundary) -> np.ndarray:
    """v* of eq. 3.1, in numpy."""
    return (1 - boundary.damping * boundary.dt) * v + boundary.dt * (
        net.inverse_mass[:, None] * force + boundary.gravity
    )


def far_apart(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a - b).max() / np.abs(b).max())


def test_it_equals_the_plain_kernels(kept_body):
    x = moved(kept_body)
    held = tuple(range(0, kept_body.node_count, 7))
    state, boundary, (volume, flow, mobility) = gathered(kept_body, x, held=held)
    net, nodes = state.model, state.nodes
    force, gradient = np.zeros_like(x), np.zeros_like(x)
    spring_forces_into(x, net.ends, net.rest_length, net.stiffness, force)
    add_membrane_forces(x, net.membrane, force)
    expected = volume_gradient_into(x, net.triangles, gradient)
    v_star = predicted(net, nodes.v, force, boundary)
    assert far_apart(nodes.force[list(held)], force[list(held)]) < ROUND_OFF
    assert far_apart(nodes.gradient, gradient) < ROUND_OFF
    assert far_apart(nodes.v_star, v_star) < ROUND_OFF
    assert volume == pytest.approx(expected, rel=ROUND_OFF)
    # Flows in and out nearly cancel: relative to their size, not to their sum.
    assert flow == pytest.approx(float((gradient * v_star).sum()), abs=ROUND_OFF * np.abs(gradient * v_star).sum())
    assert mobility == pytest.approx(float((net.inverse_mass[:, None] * gradient**2).sum()), rel=ROUND_OFF)


def test_its_gradient_is_the_derivative_of_its_volume(kept_body):
    x, direction = moved(kept_body), np.random.default_rng(5).uniform(-1, 1, kept_body.rest.shape)
    exact = float((gathered(kept_body, x)[0].nodes.gradient * direction).sum())
    step = STEP * np.abs(x).max()
    ahead, behind = (gathered(kept_body, x + side * step * direction)[2][0] for side in (1, -1))
    assert (ahead - behind) / (2 * step) == pytest.approx(exact, rel=DIFFERENCE)


def test_the_volume_keeps_its_digits_far_from_the_origin(ball_body):
    """1,000 m away positions have lost four digits of sixteen; V about the origin would lose twelve."""
    volume = gathered(ball_body, ball_body.rest + 1e3)[2][0]
    assert volume == pytest.approx(ball_body.volume, rel=1e-10)


def test_without_a_volume_the_forces_are_the_same_to_the_last_bit(ball_body):
    """A skip: springs of a ring pull in the same order whether or not the ring is walked for its area."""
    x = moved(ball_body)
    with_it, without = (gathered(ball_body, x, keeps)[0].nodes for keeps in (True, False))
    assert np.array_equal(with_it.v_star, without.v_star)
    assert not without.gradient.any()


def test_springs_at_rest_pull_with_nothing_at_all(body):
    """Rest is rest to the last bit only if c = k − k L/|d| is 0 and not round-off of k."""
    state = start(body)
    boundary = Setup(body, Free(), Clock(0.01, 1, 10)).boundary(0)
    gather_and_predict(state.model, state.nodes, state.work, boundary, True)
    # The length of a spring at rest is summed in another order here: a bit off in some.
    unit = body.springs.stiffness.max() * body.springs.rest_length.max() / body.mass.min() * boundary.dt
    assert np.abs(state.nodes.v_star).max() < 1e-15 * unit * LONGEST


def test_a_ring_goes_round_every_surface_node_once():
    points, triangles = icosphere(1)
    centre, walk, place, neighbour = rings(triangles.astype(np.uint32), len(points))
    assert sorted(centre) == list(range(len(points)))
    for number, node in enumerate(centre):
        mine = walk == number
        ring = neighbour[mine][np.argsort(place[mine])]
        across = {tuple(sorted((a, b))) for a, b in zip(ring, np.roll(ring, -1), strict=True)}
        around = {tuple(sorted(set(t) - {node})) for t in triangles[(triangles == node).any(axis=1)].tolist()}
        assert across == around and len(ring) == len(set(ring))


def touching_tetrahedra() -> Body:
    """Two tetrahedra that share one node: its neighbourhood on the surface is two rings."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]], dtype=float)
    cells = np.array([[0, 1, 2, 3], [0, 5, 4, 6]])
    triangles = cells[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
    return tetrahedral_body(points, triangles, cells, SOFT)


def many_neighbours(count: int) -> Body:
    """A ball whose node 0 is joined to `count` others outside its ring, and twice to one of its ring."""
    points, faces, tetrahedra = block((4, 4, 4))
    body = tetrahedral_body(points, faces, tetrahedra, SOFT)
    near = set(body.springs.ends[(body.springs.ends == 0).any(axis=1)].ravel().tolist())
    others = [j for j in range(len(points)) if j not in near][:count]
    twice = body.springs.ends[(body.springs.ends == 0).any(axis=1)][:1]
    ends = np.vstack([body.springs.ends, [[0, j] for j in others], twice]).astype(np.uint32)
    length = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
    stiffness = np.linspace(1.0, 2.0, len(ends))
    return Body(points, body.mass, Springs(ends, length, stiffness, np.zeros(len(ends), np.uint8)), faces, tetrahedra)


@pytest.mark.parametrize("make", [touching_tetrahedra, lambda: many_neighbours(3), lambda: many_neighbours(90)])
def test_nodes_in_pieces_equal_the_plain_kernels(make):
    body = make()
    test_it_equals_the_plain_kernels(body)


def test_a_node_of_two_rings_or_many_springs_is_in_pieces():
    for body in (touching_tetrahedra(), many_neighbours(90)):
        slices = start(body).model.slices
        assert slices.split_node.tolist() == [0] and slices.pieces == 1
    assert start(many_neighbours(3)).model.slices.pieces == 0


def test_the_multiplier_from_sums_is_the_one_over_all_nodes(ball_body):
    """Touched nodes of every kind and held ones: what they take is taken from the sums."""
    held = (3, 40, 77)
    state, boundary, (volume, flow, mobility) = gathered(ball_body, moved(ball_body), held=held)
    net, nodes, contacts, rng = state.model, state.nodes, state.contacts, np.random.default_rng(1)
    flow += prescribe(net, nodes, np.array([[0.01, 0.0, -0.02]]), boundary.dt)
    for kind, some in ((SLIDES, [5, 6, 50]), (ON_EDGE, [9, 10]), (STICKS, [60, 61])):
        contacts.mode[some] = kind
        contacts.direction[some] = rng.normal(size=(len(some), 3))
        contacts.direction[some] /= np.linalg.norm(contacts.direction[some], axis=1)[:, None]
        contacts.v_target[some] = rng.normal(size=(len(some), 3))
    list_active(contacts)
    error = 0.01 * volume
    expected = volume_multiplier(nodes, contacts, net.inverse_mass, error, boundary.dt)
    multiplier = multiplier_of_sums(nodes, contacts, net.inverse_mass, error, boundary.dt, flow, mobility)
    assert multiplier == pytest.approx(expected, rel=1e-12)
    assert multiplier[0] != pytest.approx(
        volume_multiplier(nodes, contacts, 0.9 * net.inverse_mass, error, boundary.dt)[0], rel=1e-3
    )


def test_a_body_that_obstacles_hold_everywhere_has_no_multiplier(ball_body):
    """What is left of G·W·G is round-off then; dividing by it would be a pressure of any size."""
    state, boundary, (volume, flow, mobility) = gathered(ball_body, moved(ball_body))
    state.contacts.mode[:] = STICKS
    list_active(state.contacts)
    args = (state.nodes, state.contacts, state.model.inverse_mass, 0.01 * volume, boundary.dt, flow, mobility)
    assert multiplier_of_sums(*args) == (0.0, 0.0)
