"""Explicit elements: the contract of methods, energy and forces, the step limit, a bar against a closed form."""

import numpy as np
import pytest

from massspring import Attachment, Clock, ExplicitElements, Ramp, Setup, Volumes, simulate, step_limit, tetrahedral_body
from massspring.analysis.stiffness import stiffness_at_rest
from tests.massspring.conftest import SOFT, hollow_block
from tests.massspring.methods.families.test_points import CONTRACT
from tests.massspring.methods.test_guards import LINE
from tests.massspring.methods.test_implicit_volume import start_of
from tests.massspring.methods.test_methods import clock_for, squeeze
from tests.massspring.quadratic import (
    MU,
    curved_solid,
    linear_solid,
    mixed_solid,
    nodal_energy,
    straight_solid,
    uniaxial,
)

BODIES = {
    "linear": linear_solid,
    "quadratic": curved_solid,
    "contact at nodes": lambda: curved_solid(contact="nodes"),
    "mixed": mixed_solid,
}
RATIO = ExplicitElements.bulk_ratio


@pytest.fixture(scope="module", params=("linear", "quadratic", "mixed"))
def solid(request):
    return BODIES[request.param]()


@pytest.mark.parametrize("kind", BODIES)
@pytest.mark.parametrize("promise", CONTRACT, ids=lambda promise: promise.__name__.removeprefix("test_"))
def test_the_contract_of_methods_holds(promise, kind):
    promise(BODIES[kind](), ExplicitElements())


def forces(body, x, method):
    """What a step out of rest at `x` gives to the nodes [N]."""
    setup = Setup(body, method, Clock(1e-9, 1, 1))
    state = setup.start().moved_to(x)
    return method.advance(state, setup.boundary(0)).v * body.moved_mass[:, None] / 1e-9


def moved(body, seed=3):
    """Sheared, stretched and shaken."""
    shear = np.eye(3) + np.array([[0.05, 0.2, 0.0], [0.0, -0.1, 0.1], [0.1, 0.0, 0.08]])
    shaken = 0.0006 * np.random.default_rng(seed).standard_normal(body.rest.shape)
    return body.rest @ shear.T + shaken


def test_forces_are_minus_the_gradient_of_the_energy(solid):
    x, along = moved(solid), np.random.default_rng(1).standard_normal(solid.rest.shape)
    step = 1e-6 * solid.size
    after, before = (nodal_energy(solid, x + s * along, RATIO) for s in (step, -step))
    force = forces(solid, x, ExplicitElements())
    assert (force * along).sum() == pytest.approx((before - after) / (2 * step), rel=1e-6)


def test_the_stiffness_is_the_derivative_of_the_forces_at_rest(solid):
    """All of it: that of the body and what the method adds."""
    method, step = ExplicitElements(), 1e-6 * solid.size
    along = np.random.default_rng(2).standard_normal(solid.rest.shape)
    after, before = (forces(solid, solid.rest + s * along, method) for s in (step, -step))
    factor = method.added_stiffness(solid)
    exact = -(stiffness_at_rest(solid) @ along.ravel() + factor @ (factor.T @ along.ravel())).reshape(-1, 3)
    assert np.abs((after - before) / (2 * step) - exact).max() < 1e-5 * np.abs(exact).max()


def growth(body, fraction, held):
    """By what factor random motion of 1e-9 m/s grows in 400 steps of `fraction` of the limit."""
    method = ExplicitElements()
    groups = (held,) if held else ()
    nodes = held.nodes if held else None
    dt = fraction * step_limit(body, held_nodes=nodes, added=method.added_stiffness(body)).undamped
    noise = 1e-9 * np.random.default_rng(3).standard_normal(body.rest.shape)
    setup = Setup(body, method, Clock(400 * dt, 1, 400), (), groups, velocity=noise)
    state = method.advance(setup.start(), setup.boundary(0))
    return float(np.nan_to_num(np.abs(state.nodes.v), nan=np.inf).max() / np.abs(noise).max())


@pytest.mark.parametrize("hold", [False, True], ids=["free", "held"])
def test_the_limit_of_the_step_is_where_motion_begins_to_grow(solid, hold):
    low = solid.rest[:, 2] < solid.rest[:, 2].min() + 0.2 * np.ptp(solid.rest[:, 2])
    held = Attachment(np.flatnonzero(low)) if hold else None
    assert growth(solid, 0.985, held) < 1e3 < 1e6 < growth(solid, 1.015, held)


@pytest.mark.parametrize("ratio", [10.0, 50.0])
@pytest.mark.parametrize("make", [linear_solid, straight_solid], ids=["linear", "quadratic"])
def test_a_bar_between_planes_is_that_of_the_closed_form(make, ratio):
    """Smooth planes 20 % nearer: stretch across and force of the energy, whatever the mesh."""
    body = make((2, 2, 2), distortion=0.0)
    method = ExplicitElements(ratio)
    steps = int(np.ceil(3.0 / clock_for(body, 1, 1, method=method).dt))
    planes = squeeze(body, 0.1 * np.ptp(body.rest[:, 2]), 1.0)
    history = simulate(Setup(body, method, Clock(3.0 / 30, 30, -(-steps // 30)), planes, damping=40.0))
    across, stress = uniaxial(0.8, ratio * MU + body.local_bulk)
    sides = np.ptp(body.rest, axis=0)[:2]
    assert history.outcome == "finished" and history.kinetic[-1] < 1e-9
    assert np.ptp(history.final, axis=0)[:2] / sides == pytest.approx(across, rel=2e-4)
    assert history.contact_force[-1, 1, 2] / sides.prod() == pytest.approx(-stress, rel=2e-3)
    assert history.pressure[-1].mean() == pytest.approx(ratio * MU * (1 - 0.8 * across**2), rel=2e-3)


def test_a_lumen_follows_its_target_and_presses_by_what_is_missing():
    """A penalty of the same modulus on the volume inside the wall."""
    points, triangles, tetrahedra, lumen = hollow_block()
    body = tetrahedral_body(points, triangles, tetrahedra, SOFT, "cotangent")
    body = body.keeping(Volumes.nodal(body).joined(Volumes.closed_surfaces(body, {"lumen": lumen})))
    clock = Clock(0.05, 40, int(np.ceil(0.05 / clock_for(body, 1, 1, method=ExplicitElements()).dt)))
    targets = {"lumen": Ramp((0.0, 1.0), (1.0, 1.1))}
    history = simulate(Setup(body, ExplicitElements(), clock, damping=40.0, targets=targets))
    grown = history.volume[-1, -1] / body.rest_volumes[-1]
    assert history.outcome == "finished" and 1.09 < grown < 1.1
    assert history.pressure[-1, -1] == pytest.approx(RATIO * MU * (1.0 - grown / 1.1), rel=1e-3)


def test_a_body_on_a_line_is_counted_and_not_thrown():
    body = linear_solid()
    clock = clock_for(body, 3, 10, fraction=0.2, method=ExplicitElements())
    history = simulate(Setup(body, ExplicitElements(), clock, damping=20.0, positions=start_of(body, LINE)))
    assert history.outcome == "finished" and history.singular_steps == 30
    assert np.abs(history.final[:, 1:] - body.rest[:, 1:].mean(axis=0)).max() < 1e-6 * body.size
