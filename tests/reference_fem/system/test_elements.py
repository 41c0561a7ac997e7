"""Dead loads, and the order of the quadrature."""

import numpy as np
import pytest

from reference_fem import (
    BodyForce,
    NeoHookean,
    PrescribedDisplacement,
    Problem,
    SolveError,
    Traction,
    nodes,
)
from reference_fem import equilibrium_path as solve
from reference_fem.elements.shapes import ORDER, build_elements
from reference_fem.system.assembly import deformation
from tests.reference_fem.bodies import block

SOFT = NeoHookean(1.0, 1000.0)
BOTTOM = PrescribedDisplacement(lambda x: x[2] < 1e-9)
PUSH = np.array([0.03, -0.02, 0.05])


def everywhere(value):
    """The same vector at every point, growing with time."""
    return lambda t, x: t * np.repeat(np.asarray(value)[:, None], x.shape[1], axis=1)


@pytest.mark.parametrize(
    ("load", "total"),
    [(BodyForce(everywhere(PUSH)), PUSH), (Traction(lambda x: x[2] > 1 - 1e-9, everywhere(PUSH)), PUSH)],
    ids=["body force", "traction"],
)
def test_holders_carry_a_dead_load(load, total):
    """On the unit cube a force per volume and a force per area of the lid have the same resultant."""
    state = solve(Problem(block(skew=0.1), SOFT, [BOTTOM], loads=[load]), [1.0])[0]
    np.testing.assert_allclose(state.held_force[0], -total, atol=1e-6)


def test_gravity_is_a_body_force():
    """The same equilibrium, to the Newton tolerance: gravity is on from the start, the load arrives with time."""
    mesh, pull = block(), np.array([0.0, 0.0, -0.1])
    heavy = solve(Problem(mesh, SOFT, [BOTTOM], gravity=pull / 2.0, density=2.0), [1.0])[0]
    loaded = solve(Problem(mesh, SOFT, [BOTTOM], loads=[BodyForce(everywhere(pull))]), [1.0])[0]
    np.testing.assert_allclose(heavy.u, loaded.u, atol=1e-7)


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


@pytest.mark.parametrize(("order", "exact"), [(ORDER, True), (2, False)])
def test_the_default_order_integrates_p_times_J_exactly(order, exact):
    """J is a cubic in a quadratic u, p J a quartic: against order 7, to round-off.

    Order 2 is half a percent off here, but it converges as fast: no oracle would see it.
    """

    def integral(order):
        elements = build_elements(mesh, order)
        F, p = deformation(x, elements)
        return np.sum(elements.weights * p * np.linalg.det(F))

    mesh = block(skew=0.1)
    x = 0.05 * np.random.default_rng(6).standard_normal(3 * len(nodes(mesh)) + mesh.nvertices)
    assert bool(abs(integral(order) / integral(7) - 1.0) < 1e-11) is exact
