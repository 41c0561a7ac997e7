"""Motion: order, damping and dissipation of the scheme, free flight, release, impact, probes, hung masses, refusals."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import MeshTet, MeshTet2

from reference_fem import (
    Cavity,
    DynamicsSettings,
    NeoHookean,
    NewtonSettings,
    PointMass,
    PrescribedDisplacement,
    Problem,
    RigidPlane,
    RigidSphere,
    SolveError,
    equilibrium_path,
    exact,
    motion_path,
    natural_frequencies,
    nodes,
)
from reference_fem.contact.augmented import misplacement, penetration, touch
from reference_fem.dynamics.inertia import Motion, MovingSystem, TimeStep, scheme
from tests.reference_fem.bodies import ball_octant, block, shell_octant, symmetry, whole_ball

MU, RHO = 1800.0, 1060.0
SPEED = np.sqrt(MU / RHO)
CLOSE = NewtonSettings(force_tol=1e-9, volume_tol=1e-13)
"""So that the errors seen are those of the time steps."""


class Mode:
    """The lowest mode of an octant in so small a swing (1e-5 of the radius) that it stays linear."""

    def __init__(self, kappa_over_mu):
        mesh = ball_octant(2, grade=1.0, radial=0.0)
        self.problem = Problem(mesh, NeoHookean(MU, kappa_over_mu * MU), symmetry(), density=RHO)
        modes = natural_frequencies(self.problem, 1)
        self.omega, self.size = modes.omega[0], 1e-5
        self.shape = modes.shapes[0] / np.abs(modes.shapes[0]).max()

    def path(self, steps, damping, periods=0.8, rho_inf=0.9, newton=CLOSE):
        times = np.linspace(0.0, periods * 2.0 * np.pi / self.omega, steps + 1)
        settings = DynamicsSettings(damping=damping, rho_inf=rho_inf, newton=newton)
        return motion_path(self.problem, times, settings, self.size * self.omega * self.shape)

    def errors(self, moment, damping):
        """Of u, v and a against the damped oscillator, relative to their amplitudes."""
        rate, omega = 0.5 * damping, np.sqrt(self.omega**2 - 0.25 * damping**2)
        wave = self.omega / omega * np.exp(complex(-rate, omega) * moment.t)
        swings = [(complex(-rate, omega) ** k * wave).imag for k in range(3)]
        fields = (moment.u, moment.v, moment.a)
        return [
            np.linalg.norm(f / (self.size * self.omega**k) - s / self.omega**k * self.shape)
            / np.linalg.norm(self.shape)
            for k, (f, s) in enumerate(zip(fields, swings, strict=True))
        ]


@pytest.fixture(scope="module")
def mode():
    return Mode(5000.0)


@pytest.mark.parametrize("damping", [0.0, 1.5])
def test_displacement_velocity_and_acceleration_are_of_second_order(mode, damping):
    """Halving the step quarters the error: 2 ± 0.1, the next term of the error is a tenth at 40 steps a swing."""
    errors = np.array([mode.errors(mode.path(steps, damping)[-1], damping) for steps in (40, 80)])
    np.testing.assert_allclose(np.log2(errors[0] / errors[1]), 2.0, atol=0.1)
    assert errors[1].max() < 0.01


def test_the_pressure_is_of_second_order_too(mode):
    """Against the mode's own pressure at a step four times finer; a multiplier that rings would not converge."""
    p = [mode.path(steps, 0.0)[-1].p for steps in (20, 40, 160)]
    errors = [np.linalg.norm(coarse - p[2]) for coarse in p[:2]]
    # the fine solution's own error, a 16th of the second, moves the order by 0.1
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.25)
    assert errors[1] < 0.02 * np.linalg.norm(p[2])


def test_a_soft_bulk_swings_as_well():
    """kappa = 5/3 mu: the start is elastic, not that of a constraint."""
    soft = Mode(5.0 / 3.0)
    errors = np.array([soft.errors(soft.path(steps, 0.0)[-1], 0.0) for steps in (40, 80)])
    np.testing.assert_allclose(np.log2(errors[0] / errors[1]), 2.0, atol=0.1)


def test_damping_takes_the_energy_that_it_should(mode):
    """E = E0 exp(-c t) over whole periods of the damped swing: 2 % at 80 steps a swing."""
    path = mode.path(160, 1.5, periods=2.0 / np.sqrt(1.0 - (0.75 / mode.omega) ** 2))
    total = [m.kinetic + m.energy for m in path]
    assert total[-1] / total[0] == pytest.approx(np.exp(-1.5 * path[-1].t), rel=0.02)
    assert path[-1].damped == pytest.approx(total[0] - total[-1], rel=5e-3)
    assert abs(path[-1].balance) < 5e-3 * total[0]


def test_without_dissipation_energy_stays(mode):
    """rho_inf = 1 is the trapezoidal rule: it keeps a linear oscillator's energy; 0.9 loses a little, never gains."""
    kept, lossy = (mode.path(80, 0.0, periods=4.0, rho_inf=rho) for rho in (1.0, 0.9))
    start = kept[0].kinetic
    # 1e-5 of the radius is the amplitude: energy beyond quadratic is as small
    assert max(abs(m.balance) for m in kept) < 1e-4 * start
    assert -0.05 * start < lossy[-1].balance < -1e-4 * start


@pytest.mark.parametrize("rho_inf", [0.5, 0.9])
def test_what_a_step_cannot_resolve_is_damped_by_rho_inf(mode, rho_inf):
    """Steps of a hundred periods: each leaves the share rho_inf, or n rho_inf^n, for the root is a double one."""
    path = mode.path(40, 0.0, 4000.0, rho_inf, NewtonSettings())
    size = np.array([np.linalg.norm(m.v) for m in path[20:]])
    steps = np.arange(20, 41)
    assert np.polyfit(steps, np.log(size / steps), 1)[0] == pytest.approx(np.log(rho_inf), abs=0.02)


def test_the_parameters_are_those_of_chung_and_hulbert():
    """rho_inf = 1: alpha_m = alpha_f = 1/2, beta = 1/4, gamma = 1/2; rho_inf = 0: -1, 0, 1, 3/2."""
    np.testing.assert_allclose(scheme(1.0), (0.5, 0.5, 0.25, 0.5))
    np.testing.assert_allclose(scheme(0.0), (-1.0, 0.0, 1.0, 1.5))


def test_the_tangent_is_the_slope_of_the_residual_with_inertia():
    """Central differences along one direction of the free unknowns; held ones bring no inertia of their own."""
    mesh = block((1, 1, 1))
    system = MovingSystem(
        Problem(mesh, NeoHookean(MU, 10.0 * MU), [PrescribedDisplacement(lambda x: x[2] < 1e-9)], density=RHO),
        NewtonSettings(),
        40.0,
    )
    random, free = np.random.default_rng(1), system.pattern.free
    v, a, memory = random.standard_normal((3, system.displacement_count))
    held = system.pattern.held
    old = Motion(system.rest(), v, a, memory)
    system.clock = TimeStep(old, 0.01, scheme(0.8), held, 0.0 * held, 0.0 * held)
    x, step = 1e-3 * random.standard_normal((2, system.total))
    x[held] = 0.0
    loads = system.loads_of(old.state)
    values = system.evaluate(x, loads).values
    for unknowns in (free, held):
        d = np.zeros(system.total)
        d[unknowns] = step[unknowns]
        ends = [system.evaluate(x + 1e-3 * sign * d, loads, tangent=False).residual[free] for sign in (1.0, -1.0)]
        slope = (ends[0] - ends[1]) / 2e-3
        upper = system.pattern.upper(values)
        tangent = upper + upper.T - sp.diags(upper.diagonal())
        product = tangent @ d[free] + system.pattern.lifting(values) @ d[held]
        # the third derivative over a step of 1e-6 m
        np.testing.assert_allclose(product, slope, atol=1e-6 * np.abs(slope).max())


def test_free_fall_is_a_parabola():
    """Constant acceleration is exact for the scheme; the body stays undeformed."""
    mesh, gravity = block((2, 2, 2), skew=0.1), (0.0, 1.0, -9.81)
    problem = Problem(mesh, NeoHookean(MU, 1e3 * MU), (), gravity=gravity, density=RHO)
    start = np.array([1.0, -2.0, 0.5])
    for moment in motion_path(problem, (0.1, 0.25, 0.4), DynamicsSettings(dt=0.05), start):
        g = np.array(gravity)
        expected = moment.t * start + 0.5 * moment.t**2 * g
        # force_tol 1e-6 of the weight, over the stiffness of the block
        np.testing.assert_allclose(moment.u, np.broadcast_to(expected, moment.u.shape), atol=1e-7)
        np.testing.assert_allclose(moment.v, np.broadcast_to(start + moment.t * g, moment.v.shape), atol=1e-5)
        assert moment.work == pytest.approx(RHO * g @ expected, rel=1e-6)


@pytest.fixture(scope="module")
def tumbling():
    """A ball that spins, flies and swings: omega = 1 / s, a tenth of the shear wave's, for one turn."""
    mesh = whole_ball(2)
    v0 = np.cross((0.3, -0.5, 0.8), nodes(mesh)) + np.array((0.3, 0.1, -0.2))
    problem = Problem(mesh, NeoHookean(MU, 5e3 * MU), (), density=RHO)
    path = motion_path(problem, np.linspace(0.0, 6.0, 7), DynamicsSettings(dt=0.1), v0)
    return mesh, path, MovingSystem(problem, NewtonSettings()).mass


def test_free_flight_keeps_momentum_spin_and_energy(tumbling):
    """At 60 steps to a turn: 1e-3 of the spin, 3e-3 of the energy by the scheme; 5e-5 of the volume by p/kappa."""
    mesh, path, mass = tumbling
    momenta = np.array([mass.times(m.v).sum(axis=0) for m in path])  # internal forces sum to zero: round-off
    np.testing.assert_allclose(momenta, np.broadcast_to(momenta[0], momenta.shape), rtol=1e-10)
    spins = np.array([np.cross(nodes(mesh) + m.u, mass.times(m.v)).sum(axis=0) for m in path])
    assert np.abs(spins - spins[0]).max() < 1e-3 * np.linalg.norm(spins[0])
    assert max(abs(m.balance) for m in path) < 3e-3 * path[0].kinetic
    assert max(abs(m.volume / m.volume0 - 1.0) for m in path) < 5e-5


def test_a_spinning_ball_starts_with_the_acceleration_of_the_constraint():
    """Undeformed it has no shear stress: an ideal fluid's a = -2/3 omega² x and p = rho omega² (R² - r²) / 3.

    The pressure is linear in an element, so the mean of a·x is good to 2 %, the pressure at the centre to 1 %.
    """
    mesh, omega = whole_ball(3), 0.7
    problem, x = Problem(mesh, NeoHookean(MU, 5e3 * MU), (), density=RHO), nodes(mesh)
    first = motion_path(problem, (0.0,), DynamicsSettings(), np.cross((0.0, 0.0, omega), x))[0]
    weighted = MovingSystem(problem, NewtonSettings()).mass.times(x)
    assert np.sum(weighted * first.a) == pytest.approx(-2.0 / 3.0 * omega**2 * np.sum(weighted * x), rel=0.02)
    centre = np.argmin(np.linalg.norm(x, axis=1))
    assert first.p[centre] == pytest.approx(RHO * omega**2 / 3.0, rel=0.01)


BLOCK, BOTTOM = block((1, 1, 1)), [PrescribedDisplacement(lambda x: x[2] < 1e-9)]
HEAVY = Problem(BLOCK, NeoHookean(MU, 1e3 * MU), BOTTOM, density=RHO)


@pytest.mark.parametrize(
    ("words", "bad"),
    [
        ("time step is 0", lambda: DynamicsSettings(dt=0.0)),
        ("damping is -1", lambda: DynamicsSettings(damping=-1.0)),
        ("rho_inf is 1.2", lambda: DynamicsSettings(rho_inf=1.2)),
        ("density is 0", lambda: motion_path(replace(HEAVY, density=0.0), (1.0,))),
        (r"start velocities have shape \(2,\)", lambda: motion_path(HEAVY, (1.0,), velocity0=(1.0, 2.0))),
        ("start from an equilibrium on this mesh", lambda: motion_path(HEAVY, (1.0,), start=elsewhere())),
    ],
)
def test_what_cannot_move_is_refused(words, bad):
    with pytest.raises(SolveError, match=words):
        bad()


def elsewhere():
    return equilibrium_path(replace(HEAVY, mesh=block((2, 1, 1))), (1.0,))[0]


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


G = 9.81
MESH = MeshTet2.from_mesh(MeshTet.init_tensor(np.linspace(0, 0.1, 5), np.linspace(0, 0.03, 3), np.linspace(0, 0.03, 3)))
TIP = np.flatnonzero(nodes(MESH)[:, 0] > 0.1 - 1e-9)


def beam(mass: float, gravity: float = G) -> Problem:
    """Held at one end; `mass` [kg] shared by all nodes of the other."""
    hung = tuple(PointMass(int(node), mass / len(TIP)) for node in TIP)
    held = (PrescribedDisplacement(where=lambda x: x[0] < 1e-9),)
    return Problem(MESH, NeoHookean(90e3, 45e6), held, gravity=(0, 0, -gravity), density=1070.0, masses=hung)


def test_the_holder_carries_the_weight_of_what_hangs():
    state = equilibrium_path(beam(0.05), (1.0,))[-1]
    weight = (0.05 + 1070.0 * 0.1 * 0.03**2) * G
    assert state.held_force[0, 2] == pytest.approx(weight, rel=1e-6)


def test_a_heavy_tip_swings_as_a_mass_on_a_spring():
    """omega² = k/m with the stiffness k of the tip in statics, measured by a small weight; the beam has a thousandth of
    the mass."""
    plain = equilibrium_path(beam(1e-3, 0.01), (1.0,))[-1].u[TIP, 2].mean()
    more = equilibrium_path(beam(2e-3, 0.01), (1.0,))[-1].u[TIP, 2].mean()
    stiffness = 1e-3 * 0.01 / (plain - more)
    omega = natural_frequencies(beam(100.0), 2).elastic.min()
    # The face turns too, which takes 3 h²/(4 L²) of a hundredth part: (0.75 · 0.03² + …)/0.1².
    assert omega == pytest.approx(np.sqrt(stiffness / 100.0), rel=0.02)


@pytest.mark.parametrize(("node", "mass"), [(10**6, 1.0), (0, -1.0), (0, float("nan"))])
def test_a_mass_that_cannot_hang_is_refused(node, mass):
    problem = Problem(**{**vars(beam(1.0)), "masses": (PointMass(node, mass),)})
    with pytest.raises(SolveError, match="hangs at node"):
        natural_frequencies(problem, 1)
