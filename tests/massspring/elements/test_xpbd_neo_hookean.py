"""XPBD with stable neo-Hookean constraints: gradients, one exact correction, the contract, a closed form, its dial."""

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
    Volumes,
    XpbdNeoHookean,
    simulate,
    step_limit,
)
from massspring.kernels.constraint.neo_hookean import relax_elements
from massspring.methods.elements.tangent import elements_of
from tests.massspring.elements.solids import MU, curved_solid, linear_solid, uniaxial
from tests.massspring.methods.test_methods import squeeze, thrown
from tests.massspring.methods.test_quadratic_motion import CONTRACT
from tests.massspring.quadratic import jiggled

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


def test_sweeps_and_sub_steps_are_its_dial(solid):
    """The hanging body: with more of either it comes closer to implicit elements, whose equations it solves."""
    top = (Attachment(np.flatnonzero(solid.rest[:, 2] > solid.rest[:, 2].max() - 0.006)),)

    def sag(method, steps):
        setup = Setup(solid, method, Clock(0.02, 100, steps), (), top, (0.0, 0.0, -9.81), damping=5.0)
        return (simulate(setup).final - solid.rest)[:, 2].mean()

    true = sag(ImplicitElements(), 1)
    errors = [abs(sag(XpbdNeoHookean(iterations=n), steps) / true - 1) for n, steps in ((2, 2), (20, 2), (2, 20))]
    assert errors[1] < 0.5 * errors[0] and errors[2] < 0.5 * errors[0]
    assert abs(sag(XpbdNeoHookean(iterations=10), 60) / true - 1) < 0.01


def test_what_attachments_and_the_floor_take_is_the_weight(solid):
    weight = 9.81 * solid.mass.sum()
    top = (Attachment(np.flatnonzero(solid.rest[:, 2] > solid.rest[:, 2].max() - 0.006)),)
    clock = Clock(0.02, 100, 20)
    hanging = simulate(Setup(solid, XpbdNeoHookean(), clock, (), top, (0, 0, -9.81), damping=10.0))
    assert hanging.held_force[-1, 0, 2] == pytest.approx(weight, rel=1e-3)
    floor = Plane((0, 0, float(solid.rest[:, 2].min())), (0, 0, 1))
    lying = simulate(Setup(solid, XpbdNeoHookean(), clock, (floor,), gravity=(0, 0, -9.81), damping=10.0))
    assert lying.contact_force[-1, 0, 2] == pytest.approx(weight, rel=1e-2)


@pytest.mark.parametrize("iterations", [5, 50])
def test_steps_are_stable_to_the_limit_of_the_springs_and_not_far_beyond(solid, iterations):
    """Thrown with a spin, without damping, for 300 steps."""
    v, limit = 0.3 * thrown(solid), step_limit(solid).undamped
    start = 0.5 * float(solid.mass @ (v * v).sum(axis=1))

    def highest(steps):
        setup = Setup(solid, XpbdNeoHookean(iterations=iterations), Clock(steps * limit, 300, 1), velocity=v)
        return simulate(setup).kinetic.max() / start

    assert highest(1.0) < 1.0 and highest(5.0) > 2.0


def test_targets_of_volumes_are_followed(solid):
    targets = dict.fromkeys(solid.kept.names, Ramp((0.0, 0.5), (1.0, 1.03)))
    history = simulate(Setup(solid, XpbdNeoHookean(), Clock(0.02, 60, 20), damping=10.0, targets=targets))
    grown = history.final.std(axis=0).prod() / solid.rest.std(axis=0).prod()
    assert grown == pytest.approx(1.03, abs=2e-3)


def test_what_it_cannot_do_is_refused(solid, block_body):
    for body, words in (
        (block_body, "its springs must have no length"),
        (curved_solid(contact="nodes"), "no quadratic body, its tetrahedra are linear"),
        (solid.keeping(Volumes.patches(solid)), "it keeps nodal volumes only"),
    ):
        with pytest.raises(MassSpringError, match=words):
            Setup(body, XpbdNeoHookean(), Clock(0.01, 1, 1))
    for settings in ({"bulk_ratio": 0.0}, {"iterations": 0}):
        with pytest.raises(MassSpringError, match=f"{next(iter(settings))} (is|are) .*(must be positive|at least one)"):
            XpbdNeoHookean(**settings)
