"""Energy -> stress -> tangent of every material by finite differences, in the compiled law and apart from it."""

import numpy as np
import pytest

from reference_fem import MooneyRivlin, NeoHookean, SolveError
from reference_fem.model.material import response_into

LAWS = [NeoHookean(2.0, 50.0), MooneyRivlin(0.4, 0.6, 50.0), MooneyRivlin(0.0, 1.0, 2e5)]
STEP, AGREES = 1e-5, 1e-8
"""Central differences: truncation about STEP², round-off about 1e-16 / STEP, both near 1e-10; and a margin."""


@pytest.fixture(params=LAWS, ids=["neo-Hookean", "Mooney-Rivlin", "second term alone"])
def law(request):
    return request.param


@pytest.fixture
def state():
    """A large deformation of positive determinant, a pressure, and a direction."""
    rng = np.random.default_rng(4)
    F = np.eye(3) + 0.3 * rng.standard_normal((3, 3))
    assert np.linalg.det(F) > 0.1
    return F, 1.7, rng.standard_normal((3, 3))


def compiled(law, F, p):
    """(J, P, A) of the compiled law."""
    H, P, A = np.empty((3, 3)), np.empty((3, 3)), np.empty((9, 9))
    J = response_into(np.ascontiguousarray(F), p, law.parameters, H, P, A, np.empty((3, 3, 3)), True)
    return J, P, A


def test_stress_is_the_gradient_of_the_energy(law, state):
    F, p, direction = state
    slope = law.energy_density(F + STEP * direction, p) - law.energy_density(F - STEP * direction, p)
    assert np.sum(law.stress(F, p) * direction) == pytest.approx(slope / (2 * STEP), rel=AGREES)


def test_the_compiled_stress_is_the_same(law, state):
    F, p, _ = state
    J, P, _ = compiled(law, F, p)
    assert pytest.approx(np.linalg.det(F), rel=1e-13) == J
    np.testing.assert_allclose(P, law.stress(F, p), rtol=1e-12, atol=1e-12)


def test_tangent_is_the_gradient_of_the_stress(law, state):
    F, p, direction = state
    after, before = law.stress(F + STEP * direction, p), law.stress(F - STEP * direction, p)
    product = compiled(law, F, p)[2] @ direction.ravel()
    np.testing.assert_allclose(
        product.reshape(3, 3), (after - before) / (2 * STEP), atol=AGREES * np.abs(product).max()
    )


def test_tangent_is_symmetric(law, state):
    A = compiled(law, *state[:2])[2]
    np.testing.assert_allclose(A, A.T, atol=1e-13 * np.abs(A).max())


def test_rest_is_stress_free_and_as_stiff_as_mu_says(law):
    """A small shear costs mu gamma²/2; the next term is of order gamma⁴."""
    assert np.abs(compiled(law, np.eye(3), 0.0)[1]).max() < 1e-14 * law.mu
    shear = np.eye(3)
    shear[0, 1] = 1e-3
    assert law.energy_density(shear, 0.0) == pytest.approx(0.5e-6 * law.mu, rel=1e-5)


def test_energy_and_stress_do_not_see_a_turn(law, state):
    F, p, _ = state
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    assert law.energy_density(turn @ F, p) == pytest.approx(law.energy_density(F, p), rel=1e-13)
    np.testing.assert_allclose(compiled(law, turn @ F, p)[1], turn @ compiled(law, F, p)[1], atol=1e-12)


def test_an_inverted_state_is_reported(law):
    assert compiled(law, np.diag([1.0, 1.0, -1.0]), 0.0)[0] < 0.0


@pytest.mark.parametrize(
    ("c1", "c2", "kappa", "words"),
    [
        (np.nan, 0.0, 1.0, "c1 is nan"),
        (-1.0, 2.0, 10.0, "c1 is -1"),
        (1.0, np.nan, 10.0, "c2 is nan"),
        (0.0, 0.0, 10.0, "mu"),
        (1.0, 0.0, 0.0, "kappa"),
    ],
)
def test_constants_out_of_range_are_refused(c1, c2, kappa, words):
    with pytest.raises(SolveError, match=words):
        MooneyRivlin(c1, c2, kappa)
