"""Homogeneous states: uniaxial block, weight, work."""

import numpy as np
import pytest

from reference_fem import NeoHookean, NewtonSettings, PrescribedDisplacement, Problem, equilibrium_path, exact, nodes
from reference_fem.oracles import uniaxial
from tests.reference_fem.bodies import block, symmetry

TIGHT = NewtonSettings(force_tol=1e-11, volume_tol=1e-12)
"""Newton converges quadratically: these cost one more iteration and leave round-off only."""


def test_uniaxial_closed_form_tends_to_the_incompressible_one():
    for stretch, force in ((0.7, -1.340816), (0.8, -0.7625), (0.9, -0.334568), (1.5, 1.055556)):
        assert stretch - stretch**-2 == pytest.approx(force, abs=1e-6)
        # the difference is of order mu / kappa
        assert exact.uniaxial_stress(NeoHookean(1.0, 1e6), stretch) == pytest.approx(force, abs=3e-6)


def test_uniaxial_test_notices_a_material_that_is_a_thousandth_too_stiff():
    class Stiffer(NeoHookean):
        @property
        def parameters(self):
            return np.array([1.001 * self.mu, 0.0, self.kappa])

    _, state = uniaxial.pull(Stiffer(1.0, 1000.0), 0.8, block())
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
