"""Natural frequencies: the free ball against Lamb's closed form, the mass against scikit-fem's own assembly."""

import numpy as np
import pytest
from skfem import Basis, BilinearForm, ElementTetP2

from reference_fem import (
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    SolveError,
    exact,
    natural_frequencies,
    nodes,
)
from reference_fem.dynamics.inertia import MovingSystem
from tests.reference_fem.bodies import ball_octant, block, symmetry, whole_ball

MU, RHO = 1800.0, 1060.0
SPEED = np.sqrt(MU / RHO)


def modes_of(mesh, kappa_over_mu, count, held=()):
    return natural_frequencies(Problem(mesh, NeoHookean(MU, kappa_over_mu * MU), held, density=RHO), count)


@pytest.fixture(scope="module")
def ringing():
    """216 curved elements: kappa = 5000 mu, and 5/3 mu, which is a Poisson ratio of one quarter."""
    mesh = whole_ball(3)
    return {"incompressible": modes_of(mesh, 5000.0, 10), "quarter": modes_of(mesh, 5.0 / 3.0, 10)}


def test_the_closed_form_gives_the_published_roots():
    """Five digits are published."""
    assert exact.ball_torsional() == pytest.approx(2.5011, abs=5e-5)
    assert exact.ball_spheroidal(0.5) == pytest.approx(2.6656, abs=5e-5)
    assert exact.ball_spheroidal(0.25) == pytest.approx(2.6399, abs=1e-4)


def test_frequencies_fall_towards_the_closed_form(ringing):
    """Elements of the second order: the error of a frequency falls with h⁴; 2³ to 3³ elements an octant, factor 5."""
    coarse = modes_of(whole_ball(2), 5000.0, 5).elastic.mean() / SPEED / exact.ball_torsional() - 1.0
    fine = ringing["incompressible"].elastic[:5].mean() / SPEED / exact.ball_torsional() - 1.0
    assert fine > 0.0
    assert np.log(coarse / fine) / np.log(1.5) == pytest.approx(4.0, abs=0.5)


def test_a_free_body_has_six_rigid_modes(ringing):
    """At zero: their omega² is round-off of the largest in the matrix, far below the first elastic one."""
    modes = ringing["incompressible"]
    assert modes.rigid == 6
    assert modes.omega[:6].max() < 1e-3 * modes.elastic[0]
    assert len(modes.elastic) == 10


@pytest.mark.parametrize(("held", "rigid"), [([PrescribedDisplacement(lambda x: x[2] < 1e-9)], 0), (symmetry()[2:], 3)])
def test_rigid_modes_are_what_the_holders_leave_free(held, rigid):
    """Glued: none. On a frictionless table: two slides and a turn."""
    modes = modes_of(block((2, 2, 2)), 1000.0, 4, held)
    assert modes.rigid == rigid
    assert np.all(modes.omega[:rigid] < 1e-3 * modes.elastic[0])


def test_symmetry_planes_keep_the_modes_that_respect_them():
    """An octant with its three planes: two of the five spheroidal modes, no twist."""
    modes = modes_of(ball_octant(3, grade=1.0, radial=0.0), 5000.0, 3, symmetry())
    np.testing.assert_allclose(modes.elastic[:2] / SPEED, exact.ball_spheroidal(0.5), rtol=5e-3)
    assert modes.elastic[2] / SPEED > 1.2 * exact.ball_spheroidal(0.5)


def test_shapes_are_orthonormal_and_vanish_where_held():
    mesh = block((2, 2, 2), skew=0.1)
    modes = modes_of(mesh, 1000.0, 6, [PrescribedDisplacement(lambda x: x[2] < 1e-9)])
    mass = MovingSystem(Problem(mesh, NeoHookean(MU, 1e3 * MU), (), density=RHO), NewtonSettings()).mass
    products = np.einsum("kni,lni->kl", modes.shapes, np.stack([mass.times(shape) for shape in modes.shapes]))
    np.testing.assert_allclose(products, np.eye(6), atol=1e-10)
    assert not modes.shapes[:, nodes(mesh)[:, 2] < 1e-9].any()


@pytest.fixture(scope="module")
def skewed():
    mesh = block((2, 3, 2), skew=0.1)
    system = MovingSystem(Problem(mesh, NeoHookean(MU, 1e3 * MU), (), density=RHO), NewtonSettings())
    return mesh, system, system.mass


def test_the_mass_is_that_of_scikit_fem(skewed):
    """Both integrate a quartic exactly."""
    mesh, _, mass = skewed
    basis = Basis(mesh, ElementTetP2(), intorder=6)
    expected = RHO * BilinearForm(lambda u, v, w: u * v).assemble(basis)
    np.testing.assert_allclose(mass.matrix.toarray(), expected.toarray(), atol=1e-12 * RHO)


def test_the_mass_in_the_tangent_is_the_mass(skewed):
    _, system, mass = skewed
    upper = system.pattern.upper(mass.values).toarray()
    whole = upper + np.triu(upper, 1).T
    n = system.displacement_count
    np.testing.assert_allclose(whole[:n, :n], np.kron(mass.matrix.toarray(), np.eye(3)), atol=1e-12 * RHO)
    assert not whole[n:].any()


def test_a_turning_cube_has_its_moment_of_inertia(skewed):
    """v = axis × arm about a corner's edge: 2 x kinetic energy = rho 2/3 for the unit cube about its edge."""
    mesh, _, mass = skewed
    v = np.cross([0.0, 0.0, 1.0], nodes(mesh))
    assert np.sum(v * mass.times(v)) == pytest.approx(RHO * 2.0 / 3.0, rel=1e-12)


def test_modes_need_mass_and_a_possible_count():
    mesh, material = block((1, 1, 1)), NeoHookean(MU, 1e3 * MU)
    with pytest.raises(SolveError, match="density is 0"):
        natural_frequencies(Problem(mesh, material, ()), 3)
    for count in (0, 10_000):
        with pytest.raises(SolveError, match=f"{count} modes are asked for: give 1 to "):
            natural_frequencies(Problem(mesh, material, (), density=RHO), count)
