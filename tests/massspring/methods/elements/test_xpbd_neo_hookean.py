"""XPBD with stable neo-Hookean constraints: gradients, one exact correction, the contract, a closed form, its dial."""

import numpy as np
import pytest

from massspring import Clock, Ramp, Setup, XpbdNeoHookean, simulate
from massspring.kernels.constraint.neo_hookean import relax_elements
from massspring.methods.elements.tangent import elements_of
from tests.massspring.methods.families.test_points import CONTRACT
from tests.massspring.methods.test_methods import squeeze
from tests.massspring.quadratic import MU, jiggled, linear_solid, uniaxial

RATIO = XpbdNeoHookean.bulk_ratio
SCALE = 1e-6
"""dt² [s²]."""


@pytest.fixture(scope="module")
def solid():
    return linear_solid()


@pytest.fixture(scope="module")
def one():
    """(elements of one tetrahedron, nodes away from rest, its state)."""
    body = linear_solid((1, 1, 1))
    elements = elements_of(body, RATIO * MU)
    single = elements._replace(
        **{name: getattr(elements, name)[:1] for name in ("node", "gradient", "weight", "target_ratio")}
    )
    return single._replace(target_ratio=np.array([[1.04]])), jiggled(body), XpbdNeoHookean().start(body)


def constraints(elements, x):
    """(C_D, C_H) [1] of the one tetrahedron, by definition."""
    f = np.einsum("ai,aj->ij", x[elements.node[0]], elements.gradient[0, 0])
    return np.array([np.sqrt((f * f).sum()), np.linalg.det(f) - elements.target_ratio[0, 0] - 1.0 / RATIO])


def slopes(elements, x):
    """∂C/∂x by central differences [1/m], (2, n, 3)."""
    jacobian, step = np.zeros((2, *x.shape)), 1e-6 * np.ptp(x)
    for i in elements.node[0]:
        for axis in range(3):
            near = np.zeros_like(x)
            near[i, axis] = step
            jacobian[:, i, axis] = (constraints(elements, x + near) - constraints(elements, x - near)) / (2 * step)
    return jacobian


def relaxed(one):
    """(elements, x, y after one sweep, multipliers, forces, 1/m)."""
    elements, x, state = one
    y, multiplier, push = x.copy(), np.array([[0.3, -0.2]]) * MU * elements.weight, np.zeros_like(x)
    before = multiplier.copy()
    assert not relax_elements(state.contacts, state.model.inverse_mass, elements, y, SCALE, multiplier, push)
    return y, before[0], multiplier[0], push


def test_pushes_follow_the_gradients_of_the_constraints(one):
    elements, x, state = one
    y, before, after, push = relaxed(one)
    expected = np.tensordot(after - before, slopes(elements, x), 1)
    assert np.abs(push - expected).max() < 1e-7 * np.abs(push).max()
    assert np.allclose(y - x, SCALE * state.model.inverse_mass[:, None] * push, rtol=1e-9, atol=1e-15)


def test_a_sweep_solves_both_constraints_to_first_order(one):
    """C + ∇C·Δy + l/k = 0 with k = mu V, K V (Macklin et al. 2016), linear in l."""
    elements, x, _ = one
    y, _, after, _ = relaxed(one)
    stiffness = elements.weight[0, 0] * MU * np.array([1.0, RATIO])
    left = constraints(elements, x) + np.tensordot(slopes(elements, x), y - x, 2) + after / stiffness
    assert np.abs(left).max() < 1e-7


@pytest.mark.parametrize("promise", CONTRACT, ids=lambda promise: promise.__name__.removeprefix("test_"))
def test_the_contract_of_methods_holds(promise, solid):
    promise(solid, XpbdNeoHookean())


def test_a_bar_between_planes_is_that_of_the_closed_form():
    body = linear_solid((2, 2, 2), distortion=0.0)
    planes = squeeze(body, 0.1 * np.ptp(body.rest[:, 2]), 0.5)
    history = simulate(Setup(body, XpbdNeoHookean(iterations=10), Clock(0.05, 40, 100), planes, damping=20.0))
    across, stress = uniaxial(0.8, RATIO * MU)
    sides = np.ptp(body.rest, axis=0)[:2]
    assert history.outcome == "finished"
    assert np.ptp(history.final, axis=0)[:2] / sides == pytest.approx(across, rel=1e-3)
    assert history.contact_force[-1, 1, 2] / sides.prod() == pytest.approx(-stress, rel=0.01)


def test_targets_of_volumes_are_followed(solid):
    targets = dict.fromkeys(solid.kept.names, Ramp((0.0, 0.5), (1.0, 1.03)))
    history = simulate(Setup(solid, XpbdNeoHookean(), Clock(0.02, 60, 20), damping=10.0, targets=targets))
    grown = history.final.std(axis=0).prod() / solid.rest.std(axis=0).prod()
    assert grown == pytest.approx(1.03, abs=2e-3)
