"""Forces of programs that do not report them are derivatives of an energy with the constants of the tissue."""

import numpy as np
import pytest

from studies.exchange.peers.stable_neo_hookean import PlainStableNeoHookean, StableNeoHookean

MU, LAM = 1800.0, 49 * 1800.0
REST = 0.1 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], float)
CELLS = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])


@pytest.fixture(params=[StableNeoHookean, PlainStableNeoHookean])
def law(request):
    return request.param(REST, CELLS, MU, LAM)


def test_forces_are_minus_the_derivative_of_the_energy(law):
    x = REST + 0.02 * np.random.default_rng(3).normal(size=REST.shape)
    for node in range(len(x)):
        for axis in range(3):
            step = np.zeros_like(x)
            step[node, axis] = 1e-7
            slope = (law.energy(x + step) - law.energy(x - step)) / 2e-7
            assert -law.forces(x)[node, axis] == pytest.approx(slope, rel=1e-5, abs=1e-6)


def test_at_rest_and_turned_nothing_pushes(law):
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    assert np.abs(law.forces(REST @ turn.T)).max() < 1e-12 * MU
    assert law.volume.sum() == pytest.approx(1e-3 * (1 / 6 + 1 / 3))


@pytest.mark.parametrize(
    ("strain", "modulus"), [([[0, 1, 0], [0, 0, 0], [0, 0, 0]], MU), (np.eye(3), 9 * LAM + 6 * MU)]
)
def test_small_strains_feel_the_constants_of_the_tissue(law, strain, modulus):
    """Energy density ½ mu g² of a shear g; ½ (9 lam + 6 mu) e² where all lengths grow by e."""
    small = 1e-3
    grown = [law.energy(REST @ (np.eye(3) + factor * np.array(strain, float)).T) for factor in (-small, 0, small)]
    curvature = (grown[0] - 2 * grown[1] + grown[2]) / small**2 / law.volume.sum()
    assert curvature == pytest.approx(modulus, rel=1e-4)
