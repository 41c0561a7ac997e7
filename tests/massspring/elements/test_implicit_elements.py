"""Implicit elements: the contract of methods, long steps, a bar against a closed form, weight, friction, refusals."""

import numpy as np
import pytest

from massspring import (
    Attachment,
    Clock,
    ImplicitElements,
    MassSpringError,
    Plane,
    Ramp,
    Setup,
    Sphere,
    Trajectory,
    Volumes,
    simulate,
    step_limit,
    tetrahedral_body,
)
from tests.massspring.conftest import SOFT, hollow_block
from tests.massspring.elements.solids import MU, curved_solid, linear_solid, straight_solid, uniaxial
from tests.massspring.methods.test_guards import FRAMES, LINE, LOST_AFTER, Broken, stops
from tests.massspring.methods.test_methods import clock_for, squeeze, thrown
from tests.massspring.methods.test_quadratic_motion import CONTRACT
from tests.massspring.methods.test_stress import start_of
from tests.massspring.quadratic import hollow_ball

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


def test_masses_by_stiffness_leave_the_weight_as_it_is():
    body = curved_solid(contact="nodes", inertia="stiffness")
    top = np.flatnonzero(body.rest[:, 2] > body.rest[:, 2].max() - 0.006)
    setup = Setup(body, ImplicitElements(), Clock(0.05, 60, 1), (), (Attachment(top),), (0.0, 0.0, -9.81), damping=5.0)
    assert simulate(setup).held_force[-1, 0, 2] == pytest.approx(9.81 * body.mass.sum(), rel=1e-5)


def test_a_body_on_the_floor_presses_with_its_weight(solid):
    floor = Plane((0, 0, float(solid.rest[:, 2].min())), (0, 0, 1))
    history = simulate(
        Setup(solid, ImplicitElements(), Clock(0.02, 100, 1), (floor,), gravity=(0, 0, -9.81), damping=5.0)
    )
    assert history.contact_force[-1, 0, 2] == pytest.approx(9.81 * solid.mass.sum(), rel=1e-4)
    assert history.penetration.max() < 1e-12


def test_a_sphere_presses_against_what_is_held(solid):
    top, middle = solid.rest[:, 2].max(), solid.rest[:, :2].mean(axis=0)
    down = Trajectory((0.0, 1.0), ((0, 0, 0), (0, 0, -0.008)))
    probe = Sphere((*map(float, middle), float(top) + 0.031), 0.03, down)
    floor = Attachment(np.flatnonzero(solid.rest[:, 2] < solid.rest[:, 2].min() + 0.006))
    setup = Setup(solid, ImplicitElements(), Clock(0.05, 40, 1), (probe,), (floor,), damping=5.0)
    history = simulate(setup)
    assert history.outcome == "finished" and history.min_j[-1] > 0.3 and not history.limited_corrections
    assert history.contact_force[-1, 0, 2] < -0.1
    assert history.held_force[-1, 0] == pytest.approx(-history.contact_force[-1, 0], rel=0.01, abs=0.01)


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


def test_a_block_rests_on_a_rough_slope():
    body = linear_solid((3, 3, 1), distortion=0.0)
    plane = Plane((0, 0, float(body.rest[:, 2].min())), (0, 0, 1), friction=0.9)
    gravity = (0.3 * 9.81, 0.0, -9.81)
    history = simulate(Setup(body, ImplicitElements(), Clock(0.02, 80, 1), (plane,), gravity=gravity, damping=5.0))
    sole = body.rest[:, 2] < body.rest[:, 2].min() + 1e-9
    assert np.abs(history.final - body.rest)[sole].max() < 1e-4
    assert history.contact_force[-1, 0] == pytest.approx(body.mass.sum() * np.array([-gravity[0], 0, 9.81]), abs=1e-6)


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


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning", "ignore:invalid:RuntimeWarning")
def test_what_loses_its_place_or_its_numbers_stops_the_run(solid):
    clock = clock_for(solid, FRAMES, 10)
    held = Attachment(np.array([0]), Broken(until=LOST_AFTER * clock.frame))
    stops(Setup(solid, ImplicitElements(), clock, (), (held,)), "attachment 0 is no longer finite", 3)
    v = np.zeros_like(solid.rest)
    v[3, 0] = 1e200
    stops(Setup(solid, ImplicitElements(), clock, velocity=v), "", 0)


def test_what_it_cannot_do_is_refused(block_body):
    def refused(body, words):
        with pytest.raises(MassSpringError, match=words):
            Setup(body, ImplicitElements(), Clock(0.01, 1, 1))

    refused(block_body, "its springs must have no length")
    refused(curved_solid(), "no contact inside facets, obstacles touch its nodes; take contact 'nodes'")
    refused(hollow_ball(contact="nodes"), "keep no volume of a lumen; take explicit_elements")
    points, triangles, tetrahedra, lumen = hollow_block()
    body = tetrahedral_body(points, triangles, tetrahedra, SOFT, "cotangent")
    refused(
        body.keeping(Volumes.nodal(body).joined(Volumes.closed_surfaces(body, {"lumen": lumen}))),
        "it keeps nodal volumes only",
    )
    refused(body.keeping(Volumes.patches(body)), "it keeps nodal volumes only")
    for settings in ({"bulk_ratio": -1.0}, {"tolerance": 0.0}, {"most_passes": 0}):
        with pytest.raises(MassSpringError, match=f"{next(iter(settings))} is .*(must be positive|at least one)"):
            ImplicitElements(**settings)
