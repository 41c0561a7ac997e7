"""Homogeneous states: patch test, uniaxial block, weight."""

import numpy as np
import pytest

from reference_fem import NeoHookean, NewtonSettings, PrescribedDisplacement, Problem, equilibrium_path, exact, nodes
from tests.reference_fem.bodies import block, symmetry

TIGHT = NewtonSettings(force_tol=1e-11, volume_tol=1e-12)
"""Newton converges quadratically: these cost one more iteration and leave round-off only."""

ROUND_OFF = 1e-9
"""Stresses of order mu = 1 pass through kappa = 1000 mu: 1e-16 * 1000 * a few sums, with a margin."""


def pulled(material, stretch, mesh):
    held = [
        *symmetry(),
        PrescribedDisplacement(lambda x: x[2] > 1 - 1e-9, (2,), lambda t: (0.0, 0.0, (stretch - 1.0) * t)),
    ]
    return equilibrium_path(Problem(mesh, material, held), [0.5, 1.0], TIGHT)[-1]


def test_affine_boundary_gives_an_affine_body_and_constant_pressure():
    material, mesh = NeoHookean(1.0, 1000.0), block(skew=0.1)
    F = np.array([[1.1, 0.2, 0.0], [0.0, 0.95, 0.1], [0.05, 0.0, 0.98]])
    F /= np.linalg.det(F) ** (1 / 3)
    F[:, 2] *= 1.0005  # a known volume change, so that the pressure is not zero
    held = [
        PrescribedDisplacement(
            lambda x: np.ones(x.shape[1], bool), (0, 1, 2), lambda t: (t, t, t), lambda x: (F - np.eye(3)) @ x
        )
    ]
    state = equilibrium_path(Problem(mesh, material, held), [1.0], TIGHT)[0]
    np.testing.assert_allclose(state.u, nodes(mesh) @ (F - np.eye(3)).T, atol=ROUND_OFF)
    np.testing.assert_allclose(state.p, material.kappa * (np.linalg.det(F) - 1.0), rtol=1e-7)
    np.testing.assert_allclose(state.J, 1.0005, rtol=ROUND_OFF)
    np.testing.assert_allclose(state.held_force.sum(axis=0), 0.0, atol=ROUND_OFF)


@pytest.mark.parametrize("stretch", [0.7, 0.9, 1.5])
def test_uniaxial_block_matches_its_closed_form(stretch):
    material = NeoHookean(1.0, 1000.0)
    state = pulled(material, stretch, block(skew=0.1))
    stress = exact.uniaxial_stress(material, stretch)
    assert state.held_force[3, 2] == pytest.approx(stress, rel=1e-8)
    side = exact.uniaxial_lateral_stretch(material, stretch)
    assert state.volume == pytest.approx(stretch * side**2, rel=1e-10)
    assert np.ptp(state.J) < ROUND_OFF


def test_uniaxial_closed_form_tends_to_the_incompressible_one():
    for stretch, force in ((0.7, -1.340816), (0.8, -0.7625), (0.9, -0.334568), (1.5, 1.055556)):
        assert exact.uniaxial_force(1.0, 1.0, stretch) == pytest.approx(force, abs=1e-6)
        # the difference is of order mu / kappa
        assert exact.uniaxial_stress(NeoHookean(1.0, 1e6), stretch) == pytest.approx(force, abs=3e-6)


def test_uniaxial_test_notices_a_material_that_is_a_thousandth_too_stiff():
    class Stiffer(NeoHookean):
        @property
        def parameters(self):
            return np.array([1.001 * self.mu, 0.0, self.kappa])

    state = pulled(Stiffer(1.0, 1000.0), 0.8, block())
    assert state.held_force[3, 2] != pytest.approx(exact.uniaxial_stress(NeoHookean(1.0, 1000.0), 0.8), rel=1e-4)


def test_holders_carry_the_weight():
    """A block that hangs from its top: the reaction is its weight, and rest has no pressure jump at the free end."""
    problem = Problem(
        block(),
        NeoHookean(1800.0, 1.8e6),
        [PrescribedDisplacement(lambda x: x[2] > 1 - 1e-9)],
        gravity=(0.0, 0.0, -9.81),
        density=10.0,
    )
    state = equilibrium_path(problem, [0.0], TIGHT)[0]
    np.testing.assert_allclose(state.held_force[0], (0.0, 0.0, 98.1), atol=98.1 * 1e-9)
    assert state.u[np.argmin(nodes(problem.mesh)[:, 2]), 2] < 0.0


def test_energy_is_the_work_of_the_holders():
    """Simpson's rule over the stretch, whose error at these nine points is below 1e-7."""
    held = [*symmetry(), PrescribedDisplacement(lambda x: x[2] > 1 - 1e-9, (2,), lambda t: (0.0, 0.0, 0.4 * t))]
    times = np.arange(1, 9) / 8
    path = equilibrium_path(Problem(block((1, 1, 1)), NeoHookean(1.0, 1000.0), held), times, TIGHT)
    force = np.array([0.0] + [state.held_force[3, 2] for state in path])
    work = 0.4 / 24 * (force @ np.array([1, 4, 2, 4, 2, 4, 2, 4, 1]))
    assert path[-1].energy == pytest.approx(work, rel=1e-5)
