"""Springs taken implicitly: dense systems, long steps, and obstacles that hold nodes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import coo_array

from massspring import (
    Attachment,
    Body,
    Clock,
    ImplicitSprings,
    ImplicitVolume,
    Plane,
    SemiImplicit,
    Setup,
    Trajectory,
    Volumes,
    simulate,
    step_limit,
    tetrahedral_body,
)
from massspring.kernels.contact.node_contact import ON_EDGE, SLIDES, STICKS
from massspring.methods.implicit.contact import ActiveSet
from massspring.methods.implicit.factor import Factor
from tests.massspring.conftest import SOFT, block
from tests.massspring.methods import test_methods as contract
from tests.massspring.methods.test_methods import squeeze, thrown
from tests.massspring.quadratic import curved_solid, mixed_solid

LONG = 20.0
"""Steps in explicit limits 2/ω_max."""


def limit(body: Body) -> float:
    return step_limit(body).undamped


@pytest.fixture
def started(block_body):
    """A state with two held nodes, and its factor."""
    state = ImplicitSprings().start(block_body, (Attachment(np.array([0, 1])),))
    dt = LONG * limit(block_body)
    return state, Factor(state.model, dt, 3.0), dt


def dense(model, dt: float, damping: float) -> np.ndarray:
    """A by its definition, springs one by one, held nodes without response."""
    matrix = np.diag((1 + damping * dt) * model.mass)
    for (i, j), k in zip(model.ends.astype(int), model.stiffness, strict=True):
        matrix[[i, j], [i, j]] += dt * dt * k
        matrix[[i, j], [j, i]] -= dt * dt * k
    inverse = np.zeros_like(matrix)
    free = np.flatnonzero(model.inverse_mass)
    inverse[np.ix_(free, free)] = np.linalg.inv(matrix[np.ix_(free, free)])
    return inverse


def test_the_factor_is_that_of_the_matrix(started):
    state, factor, dt = started
    inverse = dense(state.model, dt, 3.0)
    forces = np.random.default_rng(0).normal(size=(len(inverse), 3))
    assert np.allclose(factor.respond(forces), inverse @ forces, rtol=1e-10, atol=1e-12 * np.abs(inverse).max())
    nodes = np.array([4, 7, 4])
    assert np.allclose(factor.columns(nodes).T, inverse[:, nodes], rtol=1e-10, atol=1e-12 * np.abs(inverse).max())


def test_the_response_past_obstacles_is_that_of_the_saddle_point_system(started):
    """Outside truth: [A, −Cᵀ; C, 0] solved densely, for nodes that slide, stick and lie in a wedge."""
    state, factor, dt = started
    nodes, contacts, rng = state.nodes, state.contacts, np.random.default_rng(1)
    for name in ("normal", "second_normal"):
        vectors = rng.normal(size=nodes.x.shape)
        getattr(contacts, name)[:] = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    contacts.mode[[3, 5, 8, 20]] = [SLIDES, STICKS, ON_EDGE, SLIDES]
    contacts.contact_id[[3, 5, 8, 20]], contacts.second[8] = 1, 2
    contacts.v_target[:] = rng.normal(size=nodes.x.shape)
    active = ActiveSet(factor, nodes, contacts, np.arange(len(nodes.x), dtype=np.uint32), dt)
    assert len(active.nodes) == 1 + 3 + 2 + 1 and sorted(set(active.obstacle)) == [0, 1]
    rows = np.zeros((len(active.nodes), nodes.x.size))
    for row, node, direction in zip(rows, active.nodes, active.direction, strict=True):
        row[3 * node : 3 * node + 3] = direction
    inverse = np.kron(dense(state.model, dt, 3.0), np.eye(3))
    forces = rng.normal(size=nodes.x.shape)
    base = inverse @ forces.ravel()
    gamma = np.linalg.solve(rows @ inverse @ rows.T, -rows @ base)
    exact = (base + inverse @ rows.T @ gamma).reshape(-1, 3)
    assert np.allclose(active.without(factor.respond(forces)), exact, atol=1e-10 * np.abs(exact).max())
    assert np.abs(active.along(exact)).max() < 1e-10 * np.abs(exact).max()


def test_short_steps_agree_with_explicit_ones(kept_body):
    """Both are of first order, from opposite sides: at 1/16 and 1/32 of the limit they close in on each other."""
    v, duration = 0.2 * thrown(kept_body), 4 * limit(kept_body)
    apart = []
    for steps in (64, 128):
        ends = [
            simulate(Setup(kept_body, m, Clock(duration, 1, steps), gravity=(0, 0, -9.81), velocity=v)).final
            for m in (ImplicitSprings(), ImplicitVolume())
        ]
        apart.append(np.abs(ends[1] - ends[0]).max())
    moved = np.abs(ends[0] - kept_body.rest).max()
    assert apart[1] < 0.02 * moved
    assert apart[1] == pytest.approx(0.5 * apart[0], rel=0.2)


@pytest.mark.parametrize("law", ["van_gelder", "cotangent"])
def test_twenty_times_the_explicit_limit_is_stable_and_ends_in_the_same_balance(law):
    """Pressed between planes and held: force, shape and pressure of the explicit method's end."""
    body = tetrahedral_body(*block((3, 3, 2)), SOFT, law)
    if law == "cotangent":
        body = body.keeping(Volumes.nodal(body))
    ends = []
    for method, dt in ((ImplicitVolume(), 0.5 * limit(body)), (ImplicitSprings(), LONG * limit(body))):
        steps = int(np.ceil(5.0 / dt))
        setup = Setup(body, method, Clock(5.0 / steps, steps, 1), squeeze(body, 0.004, 2.0), damping=5.0)
        ends.append(simulate(setup))
    explicit, implicit = ends
    assert implicit.outcome == "finished" and implicit.min_j[-1] > 0
    assert np.abs(implicit.contact_force[-1, :, 2] / explicit.contact_force[-1, :, 2] - 1).max() < 0.005
    assert implicit.pressure[-1].mean() == pytest.approx(explicit.pressure[-1].mean(), rel=0.01)
    assert implicit.penetration.max() < 1e-12 * body.size
    assert np.abs(implicit.volume / implicit.volume_target - 1).max() < 1e-4


def test_what_is_held_and_what_it_takes(block_body):
    """A hanging block: the attachment carries the weight, whatever the step."""
    top = np.flatnonzero(block_body.rest[:, 2] > block_body.rest[:, 2].max() - 0.005)
    dt = LONG * limit(block_body)
    setup = Setup(
        block_body,
        ImplicitSprings(),
        Clock(dt, 200, 1),
        attachments=(Attachment(top),),
        gravity=(0.0, 0.0, -9.81),
        damping=2.0,
    )
    history = simulate(setup)
    assert history.held_force[-1, 0, 2] == pytest.approx(9.81 * block_body.mass.sum(), rel=1e-6)
    assert np.array_equal(history.final[top], block_body.rest[top])


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


CONTRACT = (
    contract.test_rest_stays_at_rest,
    contract.test_a_fall_is_a_parabola,
    contract.test_two_runs_are_bitwise_equal_and_leave_their_input_alone,
    contract.test_frames_are_only_a_way_of_counting,
    contract.test_the_order_is_the_one_claimed,
    contract.test_the_volume_claim,
)
DURATION = 0.6


@pytest.fixture(scope="module", params=[curved_solid, mixed_solid], ids=["vertices", "mixed"])
def own_block(request) -> Body:
    return request.param()


@pytest.mark.parametrize("promise", CONTRACT, ids=lambda promise: promise.__name__.removeprefix("test_"))
def test_the_contract_of_methods_holds(promise, own_block):
    promise(own_block, SemiImplicit())


def low(body: Body) -> np.ndarray:
    return np.flatnonzero(body.rest[:, 2] < body.rest[:, 2].min() + 0.25 * np.ptp(body.rest[:, 2]))


def springs_matrix(body: Body) -> np.ndarray:
    """K [N/m], summed spring by spring, (n, n)."""
    i, j = body.springs.ends.T.astype(int)
    k, n = body.springs.stiffness, body.node_count
    rows, columns = np.r_[i, j, i, j], np.r_[i, j, j, i]
    return coo_array((np.r_[k, k, -k, -k], (rows, columns)), shape=(n, n)).toarray()


@pytest.mark.parametrize("held", [False, True], ids=["free", "held and moved"])
def test_a_step_solves_its_equation(own_block, held):
    """A v⁺ = M v + dt (−K x + Jᵀ p + m g), eq. 12.5, row after row, with the pressures that the step ended with."""
    dt, damping, gravity = 8.0 * limit(own_block), 3.0, np.array([0.0, 0.5, -9.81])
    velocity = np.random.default_rng(2).normal(scale=0.02, size=own_block.rest.shape)
    up = Trajectory((0.0, 10.0 * dt), ((0.0, 0.0, 0.0), (0.0, 0.0, 1e-3)))
    held_nodes = (Attachment(low(own_block), up),) if held else ()
    body = replace(own_block, local_bulk=0.0)  # its pressure is no multiplier that is handed out
    setup = Setup(
        body, SemiImplicit(tolerance=1e-12), Clock(dt, 1, 1), (), held_nodes,
        gravity=tuple(gravity), damping=damping, velocity=velocity,
    )  # fmt: skip
    before = setup.start()
    after = setup.method.advance(before, setup.boundary(0))
    mass, k = np.diag(body.moved_mass), springs_matrix(body)
    v, v_new = body_order(before, before.v), body_order(after, after.v)
    pressure = after.lam + body.rest_lam
    force = (body.kept.jacobian(body.rest).T @ pressure).reshape(-1, 3) - k @ body.rest + np.outer(body.mass, gravity)
    matrix = (1.0 + damping * dt) * mass + dt**2 * k
    free = np.setdiff1d(np.arange(body.node_count), low(body) if held else [])
    left = (matrix @ v_new)[free]
    right = (mass @ v + dt * force)[free]
    # The change of the pressures is in single precision.
    np.testing.assert_allclose(left, right, atol=1e-6 * np.abs(left).max())
    if held:
        np.testing.assert_allclose(v_new[low(body), 2], 1e-3 / (10.0 * dt), rtol=1e-9)


def body_order(state, table):
    """Of a state's own order of nodes, in the body's."""
    if state.permutation is None:
        return table
    in_order = np.empty_like(table)
    in_order[:] = table[state.permutation]
    return in_order
