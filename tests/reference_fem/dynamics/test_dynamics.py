"""Motion: order, damping and dissipation of the scheme, free flight and the start, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from reference_fem import (
    DynamicsSettings,
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    SolveError,
    equilibrium_path,
    motion_path,
    natural_frequencies,
    nodes,
)
from reference_fem.dynamics.inertia import Motion, MovingSystem, TimeStep, scheme
from tests.reference_fem.bodies import ball_octant, block, symmetry, whole_ball

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
