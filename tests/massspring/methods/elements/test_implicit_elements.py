"""Implicit elements: the contract of methods, long steps, a bar against a closed form, weight, friction, refusals."""

import numpy as np
import pytest

from massspring import Attachment, Clock, ImplicitElements, Plane, Ramp, Setup, simulate, step_limit
from tests.massspring.methods.families.test_points import CONTRACT
from tests.massspring.methods.test_guards import LINE
from tests.massspring.methods.test_implicit_volume import start_of
from tests.massspring.methods.test_methods import clock_for, squeeze, thrown
from tests.massspring.quadratic import MU, curved_solid, linear_solid, straight_solid, uniaxial

BODIES = {"linear": linear_solid, "quadratic": lambda: curved_solid(contact="nodes")}
RATIO = ImplicitElements.bulk_ratio
LONG = 20.0
"""Steps in limits of the explicit springs."""


@pytest.fixture(scope="module", params=BODIES)
def solid(request):
    return BODIES[request.param]()


TWINS = (
    "moving_and_turning_the_scene_moves_and_turns_the_answer",
    "two_runs_are_bitwise_equal_and_leave_their_input_alone",
)
"""What quadratic elements promise too, but the solves are those of linear ones and take three times as long."""


def promises() -> list:
    """Parameters (kind of body, promise)."""
    rows = []
    for kind in BODIES:
        for promise in CONTRACT:
            name = promise.__name__.removeprefix("test_")
            marks = pytest.mark.campaign if kind == "quadratic" and name in TWINS else ()
            rows.append(pytest.param(kind, promise, id=f"{kind}-{name}", marks=marks))
    return rows


@pytest.mark.parametrize(("solid", "promise"), promises(), indirect=["solid"])
def test_the_contract_of_methods_holds(promise, solid):
    promise(solid, ImplicitElements())


@pytest.mark.parametrize("ratio", [10.0, 50.0])
@pytest.mark.parametrize("kind", BODIES)
def test_a_bar_between_planes_is_that_of_the_closed_form(kind, ratio):
    """Smooth planes 20 % nearer in long steps: stretch across and force of the energy; no mesh locks in it."""
    make = {"linear": linear_solid, "quadratic": lambda *a, **b: straight_solid(*a, contact="nodes", **b)}[kind]
    body = make((2, 2, 2), distortion=0.0)
    planes = squeeze(body, 0.1 * np.ptp(body.rest[:, 2]), 1.0)
    history = simulate(Setup(body, ImplicitElements(ratio), Clock(0.05, 60, 1), planes, damping=20.0))
    across, stress = uniaxial(0.8, ratio * MU + body.local_bulk)
    sides = np.ptp(body.rest, axis=0)[:2]
    assert history.outcome == "finished" and not history.limited_corrections
    assert np.ptp(history.final, axis=0)[:2] / sides == pytest.approx(across, rel=1e-5)
    assert history.contact_force[-1, 1, 2] / sides.prod() == pytest.approx(-stress, rel=1e-5)
    assert history.pressure[-1] == pytest.approx(ratio * MU * (1 - 0.8 * across**2), rel=1e-4)


def test_long_steps_lose_energy_and_stay(solid):
    """Thrown with a spin, at 20 limits of the explicit springs; the first step is far and takes about 20 passes."""
    v, method = 0.3 * thrown(solid), ImplicitElements(most_passes=60)
    history = simulate(Setup(solid, method, Clock(LONG * step_limit(solid).undamped, 30, 1), velocity=v))
    start = 0.5 * float(solid.mass @ (v * v).sum(axis=1))
    assert history.outcome == "finished" and not history.limited_corrections
    assert history.kinetic.max() < start and history.kinetic[-1] < history.kinetic[0]


def test_what_is_held_and_what_it_takes(solid):
    """A hanging body: the attachment carries the weight, whatever the step, and does not move."""
    top = np.flatnonzero(solid.rest[:, 2] > solid.rest[:, 2].max() - 0.006)
    setup = Setup(solid, ImplicitElements(), Clock(0.05, 60, 1), (), (Attachment(top),), (0.0, 0.0, -9.81), damping=5.0)
    history = simulate(setup)
    assert history.held_force[-1, 0, 2] == pytest.approx(9.81 * solid.mass.sum(), rel=1e-5)
    assert np.array_equal(history.final[top], solid.rest[top])


@pytest.mark.parametrize("friction", [0.1, 0.3])
def test_a_block_slides_down_a_slope_by_coulombs_law(friction):
    """While all of it slips the plane drags with mu times what it carries; recoiling nodes may stick, and more is never
    given. What plane and gravity give is the block's momentum."""
    body, dt, steps = linear_solid((3, 3, 1), distortion=0.0), 0.01, 30
    plane = Plane((0, 0, float(body.rest[:, 2].min())), (0, 0, 1), friction=friction)
    gravity = (0.6 * 9.81, 0.0, -9.81)
    history = simulate(Setup(body, ImplicitElements(), Clock(dt, steps, 1), (plane,), gravity=gravity))
    force = history.contact_force[:, 0]
    # In a few steps nodes recoil and the passes do not settle: those, three at most, may give too much.
    share = np.sort(np.hypot(*force.T[:2]) / force[:, 2])
    assert history.limited_corrections <= 3 and share[-4] <= friction * (1 + 1e-4)
    assert -force[3:8, 0] == pytest.approx(friction * force[3:8, 2], rel=0.01)
    weight, push = body.mass.sum(), np.cumsum(force[:, 0]) * dt
    speed = gravity[0] * dt * np.arange(1, steps + 1) + push / weight
    moved = float((body.mass @ (history.final - body.rest))[0] / weight)
    # A step that did not settle is booked as its last pass had it.
    assert moved == pytest.approx(dt * speed.sum(), rel=2e-3 if history.limited_corrections else 1e-6)
    assert moved == pytest.approx((0.6 - friction) * 9.81 * (steps * dt) ** 2 / 2, rel=0.1)


def test_targets_of_volumes_are_followed(solid):
    """All grow by 3 %: what a penalty is short of is nothing where nothing presses."""
    targets = dict.fromkeys(solid.kept.names, Ramp((0.0, 1.0), (1.0, 1.03)))
    history = simulate(Setup(solid, ImplicitElements(), Clock(0.05, 60, 1), damping=10.0, targets=targets))
    grown = history.final.std(axis=0).prod() / solid.rest.std(axis=0).prod()
    assert grown == pytest.approx(1.03, abs=2e-3)


def test_a_body_on_a_line_is_counted_and_not_thrown():
    body = linear_solid()
    clock = clock_for(body, 3, 10, fraction=0.05)
    history = simulate(Setup(body, ImplicitElements(), clock, damping=20.0, positions=start_of(body, LINE)))
    assert history.outcome == "finished" and history.singular_steps == 30
    assert np.abs(history.final[:, 1:] - body.rest[:, 1:].mean(axis=0)).max() < 1e-6 * body.size
