"""Quadratic bodies in motion: the contract of methods, the limit of the step, weight, lumens, the order of nodes."""

import numpy as np
import pytest

from massspring import (
    METHODS,
    Attachment,
    Body,
    Clock,
    ImplicitVolume,
    MassSpringError,
    Ramp,
    Setup,
    quadratic_body,
    simulate,
    step_limit,
)
from massspring.kernels.arrays.layout import Accuracy
from massspring.methods.families.points import point_volumes_frame
from massspring.methods.method import begin_frame
from tests.massspring.conftest import SOFT
from tests.massspring.methods import test_methods as contract
from tests.massspring.methods.test_methods import clock_for
from tests.massspring.quadratic import curved_block, hollow_ball, mixed_solid

CONTRACT = (
    contract.test_rest_stays_at_rest,
    contract.test_free_flight_keeps_momentum_and_spin,
    contract.test_a_fall_is_a_parabola,
    contract.test_moving_and_turning_the_scene_moves_and_turns_the_answer,
    contract.test_two_runs_are_bitwise_equal_and_leave_their_input_alone,
    contract.test_frames_are_only_a_way_of_counting,
    contract.test_the_order_is_the_one_claimed,
    contract.test_the_volume_claim,
)
GRAVITY = (0.0, 0.0, -9.81)


@pytest.fixture(scope="module")
def block() -> Body:
    return quadratic_body(*curved_block(), SOFT)


@pytest.fixture(scope="module")
def hollow() -> Body:
    return hollow_ball()


def standing(body: Body) -> Attachment:
    low = body.rest[:, 2].min()
    return Attachment(np.flatnonzero(body.rest[:, 2] < low + 0.25 * np.ptp(body.rest[:, 2])))


@pytest.mark.parametrize("promise", CONTRACT, ids=lambda promise: promise.__name__.removeprefix("test_"))
def test_the_contract_of_methods_holds(promise, block):
    promise(block, ImplicitVolume())


@pytest.mark.parametrize("make", [hollow_ball, mixed_solid], ids=["lumen", "volumes of elements"])
@pytest.mark.parametrize("promise", [CONTRACT[1], CONTRACT[3], CONTRACT[7]], ids=("spin", "turned", "volume"))
def test_the_contract_holds_with_other_volumes(promise, make):
    promise(make(), ImplicitVolume())


def with_pressures_that_stay(state, boundary):
    """One frame without a solve: the springs, the local term and mu in every volume, as `stiffness_at_rest` has it."""
    after = begin_frame(state, boundary)
    after.rows.lam[:] = after.model.rest_lam
    point_volumes_frame(after.frame(boundary), after.rows, None, Accuracy(1e-6, 0), None)
    return after


def growth(body: Body, fraction: float, inertia_held=None) -> float:
    """By what factor random motion of 1e-9 of the body grows in 400 steps of `fraction` of the limit."""
    held = np.empty(0, dtype=np.int64) if inertia_held is None else inertia_held.nodes
    dt = fraction * step_limit(body, held_nodes=held).undamped
    noise = 1e-9 * np.random.default_rng(3).standard_normal(body.rest.shape)
    groups = () if inertia_held is None else (inertia_held,)
    setup = Setup(body, ImplicitVolume(), Clock(400 * dt, 1, 400), (), groups, velocity=noise)
    state = with_pressures_that_stay(setup.start(), setup.boundary(0))
    return float(np.nan_to_num(np.abs(state.nodes.v), nan=np.inf).max() / np.abs(noise).max())


@pytest.mark.parametrize("inertia", ["lumped", "stiffness"])
@pytest.mark.parametrize("hold", [False, True], ids=["free", "held"])
def test_the_limit_of_the_step_is_where_motion_begins_to_grow(inertia, hold):
    """Volumes that are solved for would only raise it: here pressures stay what they are at rest."""
    body = quadratic_body(*curved_block(), SOFT, inertia=inertia)
    held = standing(body) if hold else None
    assert growth(body, 0.985, held) < 1e3 < 1e6 < growth(body, 1.015, held)


def sag(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Positions [m] and the force of the attachment [N] of a body that stands on its lowest nodes, at rest."""
    held = standing(body)
    dt = 0.6 * step_limit(body, 25.0, held_nodes=held.nodes).damped
    frames = int(1.6 / (20 * dt))
    history = simulate(Setup(body, ImplicitVolume(), Clock(20 * dt, frames, 20), (), (held,), GRAVITY, damping=25.0))
    assert history.outcome == "finished" and history.kinetic[-1] < 1e-10
    return history.final, history.held_force[-1, 0]


def test_an_attachment_carries_the_weight_whatever_resists_motion(block):
    """Reaction = weight; masses by stiffness leave the sag as it is."""
    places = []
    for inertia in ("lumped", "stiffness"):
        body = quadratic_body(*curved_block(), SOFT, inertia=inertia)
        place, force = sag(body)
        weight = 9.81 * body.mass.sum()
        assert np.allclose(force, [0.0, 0.0, weight], atol=1e-3 * weight)
        places.append(place)
    sunk = np.abs(places[0] - block.rest).max()
    assert sunk > 2e-4 and np.abs(places[1] - places[0]).max() < 1e-3 * sunk


def test_a_lumen_follows_its_target(hollow):
    """Filled by 15 %, its wall kept volume by volume: the radius grows as an incompressible shell's does."""
    clock = clock_for(hollow, 40, 20)
    targets = {"lumen": Ramp((0.0, 0.7 * clock.duration), (1.0, 1.15))}
    history = simulate(Setup(hollow, ImplicitVolume(), clock, damping=20.0, targets=targets))
    assert history.outcome == "finished"
    assert np.abs(history.volume / history.volume_target - 1.0).max() < 1e-5
    assert history.volume_target[-1, -1] == pytest.approx(1.15 * hollow.rest_volumes[-1])
    grown = np.cbrt(1.0 + 0.15 * hollow.rest_volumes[-1] / (hollow.volume + hollow.rest_volumes[-1]))
    outer = np.linalg.norm(hollow.rest, axis=1) > 0.999 * 0.05
    assert np.linalg.norm(history.final[outer], axis=1).mean() / 0.05 == pytest.approx(grown, rel=1e-3)


OTHERS = [method() for method in METHODS if not method.capabilities.point_volumes]


@pytest.mark.parametrize("method", OTHERS, ids=lambda method: method.name)
def test_other_methods_refuse_and_name_the_one_that_does(method, block):
    with pytest.raises(MassSpringError, match="implicit_volume"):
        Setup(block, method, clock_for(block, 1, 1))


def test_volumes_that_nothing_can_push_are_left_alone(block):
    """All nodes around a vertex held: nothing to solve for there, and the others are kept."""
    around = (block.kept.corner_volume == block.kept.corner_volume[0, 0]).any(axis=1)
    held = Attachment(np.unique(block.kept.cells[around]))
    setup = Setup(block, ImplicitVolume(), clock_for(block, 20, 20), (), (held,), GRAVITY, damping=20.0)
    history = simulate(setup)
    error = np.abs(history.volume / block.rest_volumes - 1.0)
    assert history.outcome == "finished" and not history.singular_steps
    assert error.max() < ImplicitVolume.volume_tol and error[-1].max() < 1e-5


SPEED = 0.02
