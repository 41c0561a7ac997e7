"""Motion in scenes: release, impact, moving probes, shaken patches, hollow bodies; and steps that fail."""

import numpy as np
import pytest
from skfem import MeshTet

from reference_fem import (
    Cavity,
    DynamicsSettings,
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    RigidPlane,
    RigidSphere,
    SolveError,
    equilibrium_path,
    exact,
    motion_path,
    nodes,
)
from reference_fem.contact.augmented import misplacement, penetration, touch
from reference_fem.dynamics.inertia import MovingSystem
from tests.reference_fem.bodies import ball_octant, block, shell_octant, symmetry, whole_ball

MATERIAL = NeoHookean(1.0, 5000.0)
"""With density 1 and radius 1, omega is in units of sqrt(mu/rho)/R."""


@pytest.fixture(scope="module")
def rung():
    """A ball pressed flat by 1 % between two planes, and let go: a swing in 72 steps."""
    mesh = ball_octant(3, grade=1.0, radial=0.0)
    plane = RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), lambda t: (0.0, 0.0, -t))
    pressed = equilibrium_path(Problem(mesh, MATERIAL, symmetry(), [plane]), [0.01])[0]
    problem = Problem(mesh, MATERIAL, symmetry(), density=1.0)
    times = np.linspace(0.0, 2.0 * np.pi / exact.ball_spheroidal(0.5), 73)
    return pressed, motion_path(problem, times, start=pressed)


@pytest.mark.slow
def test_a_release_starts_where_it_was_held_and_gains_nothing(rung):
    """Contact was at a point: what the mesh cannot swing is damped, 1 % of the energy a swing."""
    pressed, path = rung
    np.testing.assert_array_equal(path[0].u, pressed.u)
    assert not path[0].v.any()
    assert path[0].energy == pytest.approx(pressed.energy, rel=1e-3)
    total = [m.kinetic + m.energy for m in path]
    assert max(total) < (1.0 + 1e-3) * pressed.energy
    assert total[-1] > 0.98 * pressed.energy
    assert max(abs(m.volume / m.volume0 - 1.0) for m in path) < 1e-5


@pytest.fixture(scope="module")
def bounced():
    """A ball falls on a plane and comes back: 25 steps of contact.

    rho_inf = 0.5: at 0.9 the few nodes in contact chatter, and 64 elements gain a fifth of their energy.
    """
    plane = RigidPlane((0.0, 0.0, -1.02), (0.0, 0.0, 1.0))
    problem = Problem(whole_ball(2), NeoHookean(50.0, 5e4), (), [plane], density=1.0)
    times = np.linspace(0.0, 0.7, 36)
    return problem, motion_path(problem, times, DynamicsSettings(rho_inf=0.5), (0.0, 0.0, -1.0))


@pytest.mark.slow
def test_a_bounce_reverses_the_momentum(bounced):
    """The impulse of the plane is the change of momentum: 1 % for the trapezoid of a jagged force."""
    problem, path = bounced
    mass = MovingSystem(problem, NewtonSettings()).mass
    momentum = np.array([mass.times(m.v).sum(axis=0) for m in path])
    force = np.array([m.obstacle_force[0] for m in path])
    assert path[-1].obstacle_force[0, 2] == 0.0
    assert momentum[-1, 2] > 0.9 * abs(momentum[0, 2])
    impulse = np.trapezoid(force, [m.t for m in path], axis=0)
    assert impulse[2] == pytest.approx(momentum[-1, 2] - momentum[0, 2], rel=0.01)


@pytest.mark.slow
def test_a_bounce_keeps_the_energy(bounced):
    """Kinetic energy becomes strain energy and comes back; rho_inf takes 3 %, and nothing is gained."""
    _, path = bounced
    assert max(m.energy for m in path) > 0.6 * path[0].kinetic
    assert max(m.balance for m in path) < 1e-3 * path[0].kinetic
    assert path[-1].balance > -0.04 * path[0].kinetic
    assert path[-1].work == pytest.approx(0.0, abs=1e-12)


def test_a_point_on_its_way_out_is_out_of_place():
    """m = 2 Pa, eps = 10 Pa/m: at 0.1 m outside it is still pushed by 1 Pa; at 0.3 m it is free, and in place."""
    plain = touch(np.zeros((1, 8)), np.zeros((1, 3)), np.full((1, 1, 2), 2.0), np.array([10.0]))
    state = plain._replace(pressure=np.array([[[1.0, 0.0]]]))
    assert misplacement(state) == pytest.approx(0.1)
    assert penetration(state) == 0.0


@pytest.fixture(scope="module")
def probed():
    """A spherical probe pushed into a ball within a second, then held; the body swings much faster and is damped."""
    held = [PrescribedDisplacement(lambda x: np.abs(x[2]) < 1e-9), *symmetry()[:2]]
    probe = RigidSphere((0.0, 0.0, 1.35), 0.35, lambda t: (0.0, 0.0, -0.15 * np.sin(0.5 * np.pi * min(t, 1.0)) ** 2))
    problem = Problem(ball_octant(4), MATERIAL, held, [probe], density=0.02)
    path = motion_path(problem, np.linspace(0.0, 2.0, 11), DynamicsSettings(dt=0.02, damping=20.0))
    return path, equilibrium_path(problem, (0.5, 1.0))


def test_a_slow_probe_meets_the_quasi_static_force(probed):
    """2 % on the way, where the probe moves at a hundredth of the shear wave's speed, and 1 % where it rests."""
    path, quiet = probed
    assert path[-1].obstacle_force[0, 2] == pytest.approx(quiet[1].obstacle_force[0, 2], rel=0.01)
    np.testing.assert_allclose(path[-1].u, quiet[1].u, atol=2e-3)


def test_the_energy_of_a_probed_body_is_accounted_for(probed):
    """Work of the probe = strain + kinetic + damped, to 1 %."""
    path, _ = probed
    last = path[-1]
    assert last.work > 0.0
    assert last.damped > 0.0
    assert abs(last.balance) < 0.01 * last.work


def shaken(steps):
    """A single tetrahedron, all of whose nodes are shaken: it can only move as one."""
    swing, damping = 3.0, 0.8
    held = [
        PrescribedDisplacement(
            lambda x: np.ones(x.shape[1], bool), motion=lambda t: (0.1 * np.sin(swing * t), 0.0, 0.0)
        )
    ]
    mesh = MeshTet(np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]), np.arange(4)[:, None])
    problem = Problem(mesh, MATERIAL, held, density=12.0)
    path = motion_path(problem, (0.5, 1.0), DynamicsSettings(1.0 / steps, damping))
    force = 2.0 * 0.1 * (-(swing**2) * np.sin(swing) + damping * swing * np.cos(swing))
    return path[-1], force


def test_holders_carry_inertia_and_damping():
    """F = m (a + c v) of the prescribed motion, of second order: 1e-3 at 100 steps a second."""
    (coarse, force), (fine, _) = shaken(50), shaken(100)
    errors = [abs(m.held_force[0, 0] - force) for m in (coarse, fine)]
    assert errors[1] < 1e-3 * abs(force)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)
    np.testing.assert_allclose(fine.reaction.sum(axis=0), fine.held_force[0], atol=1e-12)
    assert abs(fine.balance) < 2e-3 * fine.work


def test_a_prescribed_motion_with_a_kink_does_not_ring():
    """Pulled from rest at once: held nodes have exactly the speed of their motion, and no acceleration later."""
    held = [PrescribedDisplacement(lambda x: x[2] < 1e-9, motion=lambda t: (0.0, 0.0, -0.1 * t))]
    problem = Problem(block((1, 1, 1)), MATERIAL, held, density=1.0)
    bottom = nodes(problem.mesh)[:, 2] < 1e-9
    for moment in motion_path(problem, (0.0, 0.2, 0.4), DynamicsSettings(dt=0.05)):
        np.testing.assert_allclose(moment.v[bottom], [[0.0, 0.0, -0.1]] * bottom.sum(), atol=1e-14)
        np.testing.assert_allclose(moment.a[bottom], 0.0, atol=1e-12)


def test_a_hollow_body_in_motion_keeps_its_content():
    """Incompressible content, the wall thrown outward at the poles: the lumen's volume stays, its pressure works."""
    lumen = Cavity(lambda x: np.linalg.norm(x, axis=0) < 0.75)
    problem = Problem(shell_octant(0.5, 4, 2), MATERIAL, symmetry(), cavities=[lumen], density=1.0)
    v0 = 0.2 * nodes(problem.mesh) * (-1.0, -1.0, 2.0)
    path = motion_path(problem, (0.2, 0.4, 0.6), DynamicsSettings(dt=0.02), v0)
    for moment in path:
        # the sphere of the rest shape, to the tolerance on volume
        assert moment.cavity_volume[0] == pytest.approx(path[0].cavity_volume[0], rel=1e-7)
        assert abs(moment.balance) < 2e-3 * (moment.kinetic + moment.energy)
    assert max(abs(m.cavity_pressure[0]) for m in path) > 0.01


def pulled(settings):
    """A cube drawn out by a half of its height, in a time in which shear waves cross it four times."""
    grip = PrescribedDisplacement(
        lambda x: x[2] > 1 - 1e-9, motion=lambda t: (0.0, 0.0, 0.5 * np.sin(0.5 * np.pi * t) ** 2)
    )
    problem = Problem(block((2, 2, 2)), MATERIAL, [PrescribedDisplacement(lambda x: x[2] < 1e-9), grip], density=0.05)
    return motion_path(problem, (0.5, 1.0), settings)


def test_steps_that_fail_are_halved():
    """Three Newton iterations do not draw the cube by a quarter in one step: shorter steps do."""
    path = pulled(DynamicsSettings(newton=NewtonSettings(max_iterations=3)))
    assert path[0].substeps > 1
    easy = pulled(DynamicsSettings(dt=0.05))
    assert easy[0].substeps == 10
    assert path[-1].held_force[1, 2] == pytest.approx(easy[-1].held_force[1, 2], rel=0.1)


def test_a_motion_that_cannot_go_on_says_where_it_was():
    with pytest.raises(SolveError, match=r"no motion found between t = 0\.00.* and t = 0\.5 s") as caught:
        pulled(DynamicsSettings(newton=NewtonSettings(max_iterations=1)))
    assert caught.value.converged == []


def test_each_moment_is_passed_on_when_it_is_solved():
    moments = []
    held = [PrescribedDisplacement(lambda x: x[2] < 1e-9)]
    problem = Problem(block((1, 1, 1)), MATERIAL, held, gravity=(0.0, 0.0, -0.1), density=1.0)
    path = motion_path(problem, (0.0, 0.1), DynamicsSettings(), on_step=moments.append)
    assert moments == path
    assert path[0].t == 0.0
    assert not path[0].u.any()
