"""Corotated elements: rotation, energy, forces, stiffness, linear elasticity at small strains, inverted elements."""

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation

from massspring import Clock, ExplicitElements, ImplicitElements, Setup, simulate, step_limit
from massspring.kernels.forces.corotated import (
    add_corotated_stiffness,
    corotated_energy,
    corotated_forces_into,
    rotation,
)
from massspring.kernels.forces.springs import spring_energy, spring_forces_into
from massspring.methods.elements.tangent import Pattern, elements_of, target_ratios
from tests.massspring.methods.families.test_points import CONTRACT
from tests.massspring.methods.test_methods import squeeze
from tests.massspring.quadratic import MU, deformation, jiggled, linear_solid

BULK = 20.0 * MU
SECOND = BULK - MU
"""Lamé's λ [Pa]."""
METHODS = (ExplicitElements(law="corotated"), ImplicitElements(law="corotated"))


@pytest.fixture(scope="module")
def solid():
    return linear_solid()


@pytest.fixture
def elements(solid):
    """With targets that differ from volume to volume."""
    filling = 1.0 + 0.1 * np.random.default_rng(0).standard_normal(solid.kept.count)
    return elements_of(solid, BULK)._replace(target_ratio=target_ratios(solid, filling))


def nearest(f):
    """The proper rotation nearest to F by a singular value decomposition (Kabsch 1976)."""
    u, _, vt = np.linalg.svd(f)
    return u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt


def stress_free(seed, inverted=False):
    """A random F with det F of the chosen sign."""
    f = np.random.default_rng(seed).standard_normal((3, 3))
    return f if (np.linalg.det(f) < 0) == inverted else f * np.array([-1.0, 1.0, 1.0])


def energy(body, elements, x):
    springs = body.springs
    return spring_energy(x, springs.ends, springs.rest_length, springs.stiffness) + corotated_energy(elements, x)


def force(body, elements, x):
    springs, pull, push = body.springs, np.empty_like(x), np.empty_like(x)
    spring_forces_into(x, springs.ends, springs.rest_length, springs.stiffness, pull)
    corotated_forces_into(elements, x, push)
    return pull + push


def stiffness(body, elements, x, exact):
    """Of elements and springs, (3n, 3n)."""
    state = ImplicitElements().start(body)
    pattern = Pattern(elements, state.model)
    data = np.zeros(len(pattern.indices))
    add_corotated_stiffness(elements, pattern.places, x, 1.0, exact, data)
    order = (3 * pattern.free[:, None] + np.arange(3)).ravel()
    own = csr_array((data, pattern.indices, pattern.indptr), shape=(len(order), len(order))).toarray()
    matrix = np.zeros_like(own)
    matrix[np.ix_(order, order)] = own
    for (i, j), k in zip(body.springs.ends, body.springs.stiffness, strict=True):
        for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            matrix[3 * a : 3 * a + 3, 3 * b : 3 * b + 3] += sign * k * np.eye(3)
    return matrix


@pytest.mark.parametrize("inverted", [False, True])
def test_the_rotation_is_the_nearest_proper_one(inverted):
    for seed in range(200):
        f = stress_free(seed, inverted)
        r, trace, defined = rotation(tuple(f.ravel()))
        expected = nearest(f)
        s = np.linalg.svd(f, compute_uv=False)
        gap = s[1] - s[2] if inverted else s[1] + s[2]
        assert defined and trace == pytest.approx(float((expected * f).sum()), rel=1e-12)
        assert np.array(r).reshape(3, 3) == pytest.approx(expected, abs=1e-13 * (s[0] / gap) ** 2 + 1e-13)


def test_a_rotation_that_is_not_unique_is_undefined():
    """Flat to a line, or a reflection: two rotations are equally near."""
    for f in (np.zeros((3, 3)), np.diag([1.0, 0.0, 0.0]), np.diag([1.0, 1.0, -1.0])):
        assert not rotation(tuple(f.ravel()))[2]


def test_the_energy_is_that_of_its_definition(solid, elements):
    x = jiggled(solid)
    f, weight = deformation(solid, x)
    r = np.array([nearest(one) for one in f])
    strain = np.einsum("eki,ekj->eij", r, f) - np.eye(3)
    missing = np.trace(strain, axis1=1, axis2=2) + 1.0 - elements.target_ratio.ravel()
    defined = float(weight @ (MU * (strain**2).sum(axis=(1, 2)) + 0.5 * SECOND * missing**2))
    rest = 0.5 * SECOND * float(weight @ (1.0 - elements.target_ratio.ravel()) ** 2)
    above = energy(solid, elements, x) - energy(solid, elements, solid.rest)
    assert above == pytest.approx(defined - rest, rel=1e-9)


def test_forces_are_minus_the_gradient_of_the_energy(solid, elements):
    x, along, step = jiggled(solid), np.random.default_rng(1).standard_normal(solid.rest.shape), 1e-6 * solid.size
    after, before = (energy(solid, elements, x + s * along) for s in (step, -step))
    slope = float((force(solid, elements, x) * along).sum())
    assert slope == pytest.approx((before - after) / (2 * step), rel=1e-6)


def test_the_exact_stiffness_is_minus_the_derivative_of_the_forces(solid, elements):
    x, along, step = jiggled(solid), np.random.default_rng(2).standard_normal(solid.rest.shape), 1e-6 * solid.size
    after, before = (force(solid, elements, x + s * along) for s in (step, -step))
    exact = -(stiffness(solid, elements, x, True) @ along.ravel()).reshape(-1, 3)
    assert np.abs((after - before) / (2 * step) - exact).max() < 1e-6 * np.abs(exact).max()


def test_the_usual_stiffness_is_that_at_rest_turned_with_the_body(solid):
    """It equals the exact one at rest, turns with the body, and is never negative."""
    elements = elements_of(solid, BULK)
    rest, turn = stiffness(solid, elements, solid.rest, False), Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    scale = np.abs(rest).max()
    assert np.abs(rest - stiffness(solid, elements, solid.rest, True)).max() < 1e-10 * scale
    all_turn = np.kron(np.eye(solid.node_count), turn)
    turned = stiffness(solid, elements, solid.rest @ turn.T, False)
    assert np.abs(turned - all_turn @ rest @ all_turn.T).max() < 1e-10 * scale
    assert np.linalg.eigvalsh(stiffness(solid, elements, jiggled(solid), False))[0] > -1e-9 * scale


def test_small_strains_are_those_of_linear_elasticity(solid):
    """sigma = 2 mu ε + λ tr ε by hand: the error falls with the square of the displacement."""
    elements = elements_of(solid, BULK)
    gradient, volume = elements.gradient[:, 0], elements.weight[:, 0]

    def error(size):
        u = size * solid.size * np.random.default_rng(4).standard_normal(solid.rest.shape)
        slope = np.einsum("eai,eaj->eij", u[elements.node], gradient)
        strain = 0.5 * (slope + slope.transpose(0, 2, 1))
        stress = 2 * MU * strain + SECOND * np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        expected = np.zeros_like(u)
        np.add.at(expected, elements.node, -np.einsum("e,eij,eaj->eai", volume, stress, gradient))
        return np.abs(force(solid, elements, solid.rest + u) - expected).max() / np.abs(expected).max()

    assert error(1e-5) < 1e-2 and error(1e-6) == pytest.approx(0.1 * error(1e-5), rel=0.05)


@pytest.mark.parametrize("promise", CONTRACT, ids=lambda promise: promise.__name__.removeprefix("test_"))
@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_the_contract_of_methods_holds(promise, method, solid):
    promise(solid, method)


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_a_bar_between_planes_is_that_of_the_closed_form(method):
    """Smooth planes 20 % nearer: linear in the stretches, E = mu (3 λ + 2 mu)/(λ + mu), nu = λ/(2 (λ + mu))."""
    body, squeezed = linear_solid((2, 2, 2), distortion=0.0), 0.2
    planes = squeeze(body, 0.5 * squeezed * np.ptp(body.rest[:, 2]), 1.0)
    dt = 0.5 * step_limit(body, added=method.added_stiffness(body)).undamped
    clock = Clock(0.05, 60, int(np.ceil(0.05 / dt)) if isinstance(method, ExplicitElements) else 1)
    history = simulate(Setup(body, method, clock, planes, damping=20.0))
    second = (method.bulk_ratio - 1.0) * MU
    across = 1.0 + squeezed * second / (2 * (second + MU))
    stress = squeezed * MU * (3 * second + 2 * MU) / (second + MU)
    sides = np.ptp(body.rest, axis=0)[:2]
    assert history.outcome == "finished"
    assert np.ptp(history.final, axis=0)[:2] / sides == pytest.approx(across, rel=1e-4)
    assert history.contact_force[-1, 1, 2] / sides.prod() == pytest.approx(stress, rel=1e-3)


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_a_body_with_inverted_elements_comes_back(method, solid):
    """One inner corner is pushed through the opposite sides of its elements, and let go."""
    x = solid.rest.copy()
    node = int(np.argmin(np.abs(x - x.mean(axis=0)).sum(axis=1)))
    x[node, 0] += 0.9 * np.ptp(x[:, 0])
    dt = 0.5 * step_limit(solid, added=method.added_stiffness(solid)).undamped
    # Explicit steps are short; implicit ones lose energy by themselves.
    clock = Clock(40 * dt, 200, 40) if isinstance(method, ExplicitElements) else Clock(0.01, 50, 1)
    history = simulate(Setup(solid, method, clock, damping=30.0, positions=x))
    assert solid.measured(x).least_j < -0.1
    assert history.outcome == "finished" and history.min_j[-1] > 0.99
