"""Springs at the end of the step by one constant matrix: its equation, its contract, and what long steps leave."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import coo_array

from massspring import (
    Attachment,
    Body,
    Clock,
    ImplicitVolume,
    Plane,
    SemiImplicit,
    Setup,
    Sphere,
    Trajectory,
    quadratic_body,
    simulate,
    step_limit,
)
from tests.massspring.conftest import SOFT
from tests.massspring.methods import test_methods as contract
from tests.massspring.quadratic import curved_block

CONTRACT = (
    contract.test_rest_stays_at_rest,
    contract.test_a_fall_is_a_parabola,
    contract.test_two_runs_are_bitwise_equal_and_leave_their_input_alone,
    contract.test_frames_are_only_a_way_of_counting,
    contract.test_the_order_is_the_one_claimed,
    contract.test_the_volume_claim,
)
DURATION = 0.6


@pytest.fixture(scope="module")
def block() -> Body:
    return quadratic_body(*curved_block(), SOFT)


@pytest.mark.parametrize("promise", CONTRACT, ids=lambda promise: promise.__name__.removeprefix("test_"))
def test_the_contract_of_methods_holds(promise, block):
    promise(block, SemiImplicit())


def low(body: Body) -> np.ndarray:
    return np.flatnonzero(body.rest[:, 2] < body.rest[:, 2].min() + 0.25 * np.ptp(body.rest[:, 2]))


def limit_of(body: Body) -> float:
    return step_limit(body).undamped


def springs_matrix(body: Body) -> np.ndarray:
    """K [N/m], summed spring by spring, (n, n)."""
    i, j = body.springs.ends.T.astype(int)
    k, n = body.springs.stiffness, body.node_count
    rows, columns = np.r_[i, j, i, j], np.r_[i, j, j, i]
    return coo_array((np.r_[k, k, -k, -k], (rows, columns)), shape=(n, n)).toarray()


@pytest.mark.parametrize("held", [False, True], ids=["free", "held and moved"])
def test_a_step_solves_its_equation(block, held):
    """A v⁺ = M v + dt (−K x + Jᵀ p + m g), eq. 12.5, row after row, with the pressures that the step ended with."""
    dt, damping, gravity = 8.0 * limit_of(block), 3.0, np.array([0.0, 0.5, -9.81])
    velocity = np.random.default_rng(2).normal(scale=0.02, size=block.rest.shape)
    up = Trajectory((0.0, 10.0 * dt), ((0.0, 0.0, 0.0), (0.0, 0.0, 1e-3)))
    held_nodes = (Attachment(low(block), up),) if held else ()
    body = replace(block, local_bulk=0.0)  # its pressure is no multiplier that is handed out
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
    np.testing.assert_allclose(left, right, atol=1e-9 * np.abs(left).max())
    if held:
        np.testing.assert_allclose(v_new[low(body), 2], 1e-3 / (10.0 * dt), rtol=1e-9)


def body_order(state, table):
    """Of a state's own order of nodes, in the body's."""
    if state.permutation is None:
        return table
    in_order = np.empty_like(table)
    in_order[:] = table[state.permutation]
    return in_order


def pressed(body: Body, method, dt: float, obstacle):
    frames = 30
    steps = max(1, round(DURATION / frames / dt))
    clock = Clock(DURATION / frames, frames, steps)
    return simulate(Setup(body, method, clock, (obstacle,), (Attachment(low(body)),), damping=30.0))


@pytest.mark.parametrize("kind", ["plane", "sphere"])
def test_a_press_comes_to_the_force_of_explicit_steps(block, kind):
    """A press that ends at rest: the force of explicit steps, at once at half their limit and slower at twice."""
    top, size = block.rest[:, 2].max(), np.ptp(block.rest[:, 2])
    down = Trajectory((0.0, 0.2), ((0.0, 0.0, 0.0), (0.0, 0.0, -0.06 * size)))
    plane = Plane((0.0, 0.0, top), (0.0, 0.0, -1.0), down)
    middle = block.rest[:, :2].mean(axis=0)
    obstacle = plane if kind == "plane" else Sphere((*middle, top + 2.0 * size), 2.0 * size, down)
    short = pressed(block, ImplicitVolume(), 0.5 * limit_of(block), obstacle)
    assert short.outcome == "finished"
    force = short.contact_force[:, 0]
    for fraction, short_by in ((0.5, 1e-3), (2.0, 0.2)):
        long = pressed(block, SemiImplicit(), fraction * limit_of(block), obstacle)
        missing = np.abs(force - long.contact_force[:, 0]).max(axis=1) / np.abs(force[-1]).max()
        assert long.outcome == "finished" and missing[-1] < short_by
        assert missing[-1] < 0.5 * missing[12]


def test_a_moved_attachment_takes_the_body_along(block):
    """All of it follows a slow way, and the force at the end is the body's weight."""
    way = Trajectory((0.0, 0.3), ((0.0, 0.0, 0.0), (0.01, 0.0, 0.02)))
    clock = Clock(0.02, 30, 1)
    setup = Setup(
        block, SemiImplicit(), clock, (), (Attachment(low(block), way),), damping=30.0, gravity=(0.0, 0.0, -9.81)
    )
    history = simulate(setup)
    assert history.outcome == "finished" and clock.dt > 5.0 * limit_of(block)
    weight = 9.81 * block.mass.sum()
    assert np.abs(history.held_force[-1, 0] - (0.0, 0.0, weight)).max() < 1e-2 * weight
    shift = block.mass @ (history.final - block.rest) / block.mass.sum()
    assert shift[0] == pytest.approx(0.01, rel=0.02)
