"""What every element of the table promises, and dead loads on each of them."""

import numpy as np
import pytest

from reference_fem import (
    ELEMENTS,
    BodyForce,
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    SolveError,
    Traction,
    nodes,
)
from reference_fem import equilibrium_path as solve
from reference_fem.elements.shapes import build_elements
from reference_fem.elements.table import DEFAULT
from reference_fem.oracles import cylinder
from reference_fem.system.assembly import deformation
from reference_fem.system.saddle_point import System
from tests.reference_fem.bodies import block

SOFT = NeoHookean(1.0, 1000.0)
BOTTOM = PrescribedDisplacement(lambda x: x[2] < 1e-9)
PUSH = np.array([0.03, -0.02, 0.05])


def everywhere(value):
    """The same vector at every point, growing with time."""
    return lambda t, x: t * np.repeat(np.asarray(value)[:, None], x.shape[1], axis=1)


@pytest.fixture(params=list(ELEMENTS))
def element(request):
    return request.param


def test_results_are_given_at_the_nodes_of_the_mesh(element):
    mesh = block()
    state = solve(Problem(mesh, SOFT, [BOTTOM], loads=[BodyForce(everywhere(PUSH))], element=element), [1.0])[0]
    assert state.u.shape == state.reaction.shape == nodes(mesh).shape
    assert state.p.shape == (mesh.nvertices,)
    assert np.abs(state.u).max() > 1e-3


@pytest.mark.parametrize(
    ("load", "total"),
    [(BodyForce(everywhere(PUSH)), PUSH), (Traction(lambda x: x[2] > 1 - 1e-9, everywhere(PUSH)), PUSH)],
    ids=["body force", "traction"],
)
def test_holders_carry_a_dead_load(element, load, total):
    """On the unit cube a force per volume and a force per area of the lid have the same resultant."""
    state = solve(Problem(block(skew=0.1), SOFT, [BOTTOM], loads=[load], element=element), [1.0])[0]
    np.testing.assert_allclose(state.held_force[0], -total, atol=1e-6)


def test_gravity_is_a_body_force(element):
    """The same equilibrium, to the Newton tolerance: gravity is on from the start, the load arrives with time."""
    mesh, pull = block(), np.array([0.0, 0.0, -0.1])
    heavy = solve(Problem(mesh, SOFT, [BOTTOM], gravity=pull / 2.0, density=2.0, element=element), [1.0])[0]
    loaded = solve(Problem(mesh, SOFT, [BOTTOM], loads=[BodyForce(everywhere(pull))], element=element), [1.0])[0]
    np.testing.assert_allclose(heavy.u, loaded.u, atol=1e-7)


def test_a_locking_element_is_far_too_stiff_and_the_others_are_not(element):
    """Coarse thick cylinder at nu = 0.4999, against Lamé: a locking one has less than half, others are within 3 %."""
    _, displacement = cylinder.press(element, 0.4999, (6, 8))
    share = displacement / cylinder.exact.thick_cylinder_displacement(0.4999)
    assert share < 0.5 if ELEMENTS[element].locks else share == pytest.approx(1.0, abs=0.03)


def test_an_eliminated_pressure_solves_the_volume_equation_of_its_element():
    """P2/P0 at kappa = mu: the mean of J - p / kappa is one in every element."""
    problem = Problem(block(), NeoHookean(1.0, 1.0), [BOTTOM], loads=[BodyForce(everywhere(PUSH))], element="P2/P0")
    state, system = solve(problem, [1.0])[0], System(problem, NewtonSettings())
    w, corners = system.elements.weights, problem.mesh.t.T
    mean = np.sum(w * (state.J - 1.0), axis=1) / w.sum(axis=1)
    total = np.zeros(problem.mesh.nvertices)
    np.add.at(total, corners, (w.sum(axis=1) * mean)[:, None])
    share = np.zeros(problem.mesh.nvertices)
    np.add.at(share, corners, w.sum(axis=1)[:, None])
    np.testing.assert_allclose(state.p, total / share, rtol=1e-9)


def test_an_unknown_element_is_refused():
    with pytest.raises(SolveError, match="choose one of P2/P1, MINI, P2/P0, P1"):
        solve(Problem(block(), SOFT, [BOTTOM], element="Q1"), [1.0])


@pytest.mark.parametrize(
    ("load", "words"),
    [
        (Traction(lambda x: x[0] > 9.0, everywhere(PUSH)), "acts on no facet"),
        (BodyForce(lambda t, x: np.full_like(x, np.nan)), "finite values of shape"),
        (BodyForce(lambda t, x: x[0]), "finite values of shape"),
    ],
)
def test_bad_loads_are_refused(load, words):
    with pytest.raises(SolveError, match=words):
        solve(Problem(block(), SOFT, [BOTTOM], loads=[load]), [1.0])


@pytest.mark.parametrize(("order", "exact"), [(ELEMENTS[DEFAULT].order, True), (2, False)])
def test_the_default_order_integrates_p_times_J_exactly(order, exact):
    """J is a cubic in a quadratic u, p J a quartic: against order 7, to round-off.

    Order 2 is half a percent off here, but it converges as fast: no oracle would see it.
    """

    def integral(order):
        elements = build_elements(mesh, order)
        F, p = deformation(x, elements, 1.0)
        return np.sum(elements.weights * p * np.linalg.det(F))

    mesh = block(skew=0.1)
    x = 0.05 * np.random.default_rng(6).standard_normal(3 * len(nodes(mesh)) + mesh.nvertices)
    assert bool(abs(integral(order) / integral(7) - 1.0) < 1e-11) is exact
