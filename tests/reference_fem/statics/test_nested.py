"""Solutions carried from mesh to mesh: fields exact where they can be, the equilibrium that of a path from rest."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import MeshTet

from reference_fem import (
    Cavity,
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    RigidPlane,
    RigidSphere,
    SolveError,
    equilibrium_path,
    nodes,
)
from reference_fem.elements.evaluate import Evaluator
from reference_fem.elements.surface import point_positions
from reference_fem.statics import nested
from reference_fem.statics.nested import carried, continued, multipliers, repaired, transfer, unbalanced
from reference_fem.statics.newton import StepFailed, solve_step
from reference_fem.system import assembly
from reference_fem.system.saddle_point import System
from tests.reference_fem.bodies import ball_octant, block, symmetry
from tests.reference_fem.model.test_cavity import closed_problem, hollow_cube, in_the_middle

DEEP = 0.2
"""How far the plane goes in, over the radius."""
STRICT = NewtonSettings(force_tol=1e-8, penetration_tol=1e-6)
"""What contact sinks in by, within the usual tolerance, depends on the way."""


def onto(coarse, fine):
    """The transfer to a mesh of the same body."""
    return transfer(coarse, Evaluator(coarse).locate(nodes(fine))[0], nodes(fine))


def quadratic(x):
    """A displacement of second order in every component, (n, 3)."""
    a, b, c = x.T
    return np.stack([0.1 * a * b - 0.2 * c, 0.3 * c**2 + 0.1 * a, 0.2 * b * c - 0.1 * a**2 + 0.05], axis=1)


def linear(x):
    """A field of first order, (n,)."""
    return 2.0 - 0.7 * x[:, 0] + 0.3 * x[:, 1] + 1.1 * x[:, 2]


@pytest.fixture(scope="module")
def straight():
    """A skew block, and its parts."""
    coarse = block((3, 2, 2), skew=0.05)
    return coarse, coarse.refined()


def test_parts_of_a_straight_mesh_get_quadratic_fields_exactly(straight):
    coarse, fine = straight
    to = onto(coarse, fine)
    u, p = to.displacement(quadratic(nodes(coarse))), to.pressure(linear(coarse.p.T), fine.nvertices)
    np.testing.assert_allclose(u, quadratic(nodes(fine)), rtol=0, atol=1e-14)
    np.testing.assert_allclose(p, linear(fine.p.T), rtol=0, atol=1e-14)
    assert u.shape == nodes(fine).shape and p.shape == (fine.nvertices,)


@pytest.fixture(scope="module")
def round_pair():
    """Two meshes of an eighth of a ball, whose elements are curved."""
    return ball_octant(3), ball_octant(6)


def test_a_curved_mesh_passes_a_linear_displacement_on(round_pair):
    coarse, fine = round_pair
    turned = lambda mesh: nodes(mesh) @ np.array([[0.1, 0.2, -0.3], [0.0, 0.4, 0.1], [0.2, 0.0, -0.1]])  # noqa: E731
    field = onto(coarse, fine).displacement(turned(coarse))
    np.testing.assert_allclose(field, turned(fine), rtol=0, atol=1e-12)


def pressed(mesh):
    """An eighth of a ball below a plane that comes down."""
    plane = RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), lambda t: (0.0, 0.0, -t))
    return Problem(mesh, NeoHookean(1.0, 1000.0), symmetry(), [plane])


@pytest.fixture(scope="module")
def coarse_end(round_pair):
    """The coarse ball at the end of its path."""
    checkpoints = []
    equilibrium_path(pressed(round_pair[0]), (DEEP / 2, DEEP), STRICT, on_checkpoint=checkpoints.append)
    return System(pressed(round_pair[0]), STRICT), checkpoints[-1].state


@pytest.fixture(scope="module")
def path(round_pair):
    """The fine ball from rest."""
    return equilibrium_path(pressed(round_pair[1]), (DEEP / 2, DEEP), STRICT)


@pytest.fixture(scope="module")
def from_rest(path):
    """The end of the fine ball's path."""
    return path[-1]


@pytest.fixture
def start(round_pair, coarse_end):
    """The fine system, and the coarse state carried to it."""
    coarse, fine = round_pair
    system = System(pressed(fine), STRICT)
    yield system, carried(*coarse_end, system, onto(coarse, fine))
    system.solver.release()


def displacement(system, state):
    return state.x[: system.displacement_count].reshape(-1, 3)


def apart(system, state, truth):
    """Largest distance to the displacement of an equilibrium, over its largest displacement."""
    return np.abs(displacement(system, state) - truth.u).max() / np.abs(truth.u).max()


def as_it_presses(system, state):
    """A carried state with the multipliers of its pressures."""
    first = multipliers(system, state.x, state.t, state.pressure)
    return replace(state, multiplier=first, pressure=first)


def test_a_carried_state_is_that_of_the_coarse_mesh(start, coarse_end, round_pair):
    """Held unknowns have their prescribed values, contact points the pressure of their nearest neighbour."""
    system, state = start
    coarse, coarse_state = coarse_end
    fine_nodes = nodes(round_pair[1])
    inside = np.linalg.norm(fine_nodes, axis=1) < 0.9
    there = Evaluator(round_pair[0]).displacement(displacement(coarse, coarse_state), fine_nodes[inside])
    free = np.abs(fine_nodes[inside]) > 1e-9
    np.testing.assert_allclose(displacement(system, state)[inside][free], there[free], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(state.x[system.pattern.held], system.held_at(DEEP))
    assert (state.t, state.load) == (coarse_state.t, coarse_state.load)
    near, far = (point_positions(np.zeros(len(s.surface.rest)), s.surface).reshape(-1, 3) for s in (coarse, system))
    nearest = np.array([np.argmin(((near - point) ** 2).sum(axis=1)) for point in far[::17]])
    np.testing.assert_array_equal(state.pressure.ravel()[::17], coarse_state.pressure.ravel()[nearest])
    assert (state.pressure > 0).any()
    touch = system.evaluate(state.x, system.loads_of(as_it_presses(system, state)), tangent=False).touch
    np.testing.assert_allclose(touch.pressure, state.pressure, rtol=1e-9, atol=1e-9 * state.pressure.max())


def test_the_equilibrium_is_that_of_a_path_from_rest_in_fewer_iterations(start, path):
    """The carried field itself is far off."""
    system, state = start
    equilibrium = continued(system, state)
    assert apart(system, state, path[-1]) > 0.05
    assert apart(system, equilibrium, path[-1]) < 1e-4
    assert 1 <= equilibrium.iterations < 0.7 * sum(step.newton_iterations for step in path)


PROBE, DEPTH = 0.15, 0.2


def probed(mesh):
    """An eighth of a ball below a small sphere that comes down."""
    sphere = RigidSphere((0.0, 0.0, 1.0 + PROBE), PROBE, lambda t: (0.0, 0.0, -DEPTH * t))
    return Problem(mesh, NeoHookean(1.0, 1000.0), symmetry(), [sphere])


def test_a_carried_state_is_stable_under_a_probe_too(monkeypatch):
    """Its points press as on the coarse mesh, on a surface that lies elsewhere: with the pressures as multipliers they
    would press up to 26 times as hard, their tangent would not be positive definite, and Newton would take 11 steps."""
    coarse, fine = ball_octant(4), ball_octant(8)
    checkpoints = []
    equilibrium_path(probed(coarse), np.linspace(0.1, 1.0, 10), on_checkpoint=checkpoints.append)
    systems = [System(probed(mesh), NewtonSettings()) for mesh in (coarse, fine)]
    state = carried(systems[0], checkpoints[-1].state, systems[1], onto(coarse, fine))
    touch = systems[1].evaluate(state.x, systems[1].loads_of(state), tangent=False).touch
    assert touch.pressure.max() > 10 * state.pressure.max()
    few = continued(systems[1], state).iterations
    monkeypatch.setattr(nested, "multipliers", lambda system, x, t, pressure: pressure)
    many = continued(systems[1], state).iterations
    assert few <= 8 and many > 1.4 * few


def failing(monkeypatch, times):
    """Makes the first `times` steps fail; the dead forces of all steps, and the iterations of those that succeed."""
    forces, iterations = [], []

    def step(system, state, t, load, more=0.0):
        forces.append(more)
        if len(forces) <= times:
            raise StepFailed("made to fail")
        equilibrium = solve_step(system, state, t, load, more)
        iterations.append(equilibrium.iterations)
        return equilibrium

    monkeypatch.setattr(nested, "solve_step", step)
    return forces, iterations


def heavy(mesh):
    """A block that hangs by its foot."""
    held = [PrescribedDisplacement(lambda x: x[2] < 1e-9)]
    return Problem(mesh, NeoHookean(1.0, 1000.0), held, gravity=(0.2, 0.0, -1.0), density=0.1)


@pytest.fixture
def hanging(straight):
    """The fine system of a hanging block, and the coarse state carried to it."""
    coarse, fine = straight
    checkpoints = []
    equilibrium_path(heavy(coarse), (1.0,), on_checkpoint=checkpoints.append)
    systems = [System(heavy(mesh), NewtonSettings()) for mesh in (coarse, fine)]
    return systems[1], carried(systems[0], checkpoints[-1].state, systems[1], onto(coarse, fine))


@pytest.mark.parametrize("failures", [1, 2])
def test_where_one_step_fails_the_missing_forces_are_taken_away_little_by_little(hanging, monkeypatch, failures):
    system, state = hanging
    truth = solve_step(system, state, 1.0, 1.0)
    forces, iterations = failing(monkeypatch, failures)
    missing = unbalanced(system, as_it_presses(system, state))
    equilibrium = continued(system, state)
    assert np.abs(equilibrium.x - truth.x).max() < 1e-4 * np.abs(truth.x).max()
    tried = [0.0 if np.isscalar(force) else force @ missing / (missing @ missing) for force in forces]
    first = 1 - 0.5**failures
    assert tried[0] == 0.0 and tried[failures] == pytest.approx(first)
    assert tried[failures:] == pytest.approx([first - k * (1 - first) for k in range(len(tried) - failures)])
    assert tried[-1] == 0.0 and np.all(np.diff(tried[failures:]) < 0)
    assert equilibrium.iterations == sum(iterations) and len(iterations) > 1


@pytest.mark.parametrize(("under", "tries"), [("hanging", 7), ("start", 1)])
def test_a_state_that_no_share_of_the_forces_helps_is_given_up(under, tries, request, monkeypatch):
    """Under an obstacle after one try: a path from rest ends sooner."""
    system, state = request.getfixturevalue(under)
    forces, _ = failing(monkeypatch, 1000)
    with pytest.raises(StepFailed, match="made to fail"):
        continued(system, state)
    assert len(forces) == tries


def test_the_missing_forces_hold_a_carried_state_as_it_is(hanging):
    """Without contact, whose pressures a step solves for; and without those forces the state moves."""
    system, state = hanging
    missing = unbalanced(system, state)
    assert not missing[system.pattern.held].any()
    held, moved = solve_step(system, state, 1.0, 1.0, missing), continued(system, state)
    assert held.iterations == 1 and 1 < moved.iterations <= 4
    np.testing.assert_allclose(held.x, state.x, rtol=0, atol=1e-12)
    assert np.abs(displacement(system, moved) - displacement(system, state)).max() > 1e-3
    upside_down = state.x.copy()
    upside_down[2 : system.displacement_count : 3] -= 2.5 * nodes(system.problem.mesh)[:, 2]
    assert unbalanced(system, replace(state, x=upside_down)) is None


@pytest.mark.parametrize("body", ["solid", "hollow"])
def test_a_step_from_an_inverted_element_fails_as_one_that_a_shorter_one_may_replace(body):
    """With a closed lumen NumPy's own error came through once, and the reference was lost."""
    system = System(heavy(block((2, 2, 2))) if body == "solid" else closed_problem(), NewtonSettings())
    state = system.rest()
    state.x[2 : system.displacement_count : 3] -= 2.5 * nodes(system.problem.mesh)[:, 2]
    with pytest.raises(StepFailed, match="inverted"):
        solve_step(system, state, 1.0, 1.0)


def inverted(system, x):
    """Elements that are inside out at a quadrature point."""
    J = np.linalg.det(assembly.deformation(x[: system.field_count], system.elements)[0])
    return np.flatnonzero(J.min(axis=1) <= 0.0)


@pytest.fixture(scope="module")
def cube():
    """A block that is held below."""
    held = [PrescribedDisplacement(lambda x: x[2] < 1e-9)]
    return System(Problem(block((3, 3, 3)), NeoHookean(1.0, 1000.0), held), NewtonSettings())


@pytest.mark.parametrize("kind", ["middle", "vertex"])
def test_an_inverted_element_is_made_upright(cube, kind):
    """A mid-side node far from the middle of its edge, or a vertex that has gone through a face."""
    mesh = cube.problem.mesh
    x, rest = np.zeros(cube.total), nodes(mesh)
    inner = np.flatnonzero((rest > 0.2).all(axis=1) & (rest < 0.8).all(axis=1))
    node = inner[inner < mesh.nvertices][0] if kind == "vertex" else inner[inner >= mesh.nvertices][0]
    x[3 * node : 3 * node + 3] = (0.3, -0.1, 0.2)
    x[cube.displacement_count :] = 0.4
    assert len(inverted(cube, x))
    upright = repaired(cube, x)
    assert not len(inverted(cube, upright))
    np.testing.assert_array_equal(upright[cube.displacement_count :], 0.4)
    np.testing.assert_array_equal(upright[cube.pattern.held], x[cube.pattern.held])
    if kind == "middle":
        assert not upright[: cube.displacement_count].any(), "it is put between its ends, and nothing else moves"
    away = np.linalg.norm(rest - rest[node], axis=1) > 0.8
    assert not upright[: cube.displacement_count].reshape(-1, 3)[away].any(), "what is far away stays"


def test_what_sticks_is_not_carried(round_pair):
    coarse, fine = round_pair
    plane = RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), lambda t: (0.0, 0.0, -t), "no_slip")
    systems = [System(replace(pressed(mesh), obstacles=(plane,)), NewtonSettings()) for mesh in (coarse, fine)]
    with pytest.raises(SolveError, match="solve its path from rest"):
        carried(systems[0], systems[0].rest(), systems[1], onto(coarse, fine))


def filled(mesh):
    """A hollow cube under its weight, held below and full."""
    return Problem(
        mesh,
        NeoHookean(1.0, 1000.0),
        [PrescribedDisplacement(lambda x: x[2] < 1e-9)],
        gravity=(0.0, 0.0, -1.0),
        density=0.05,
        cavities=[Cavity(in_the_middle, volume=lambda t: 1.0 + 0.2 * t)],
    )


def test_a_lumen_keeps_its_pressure_and_its_volume():
    """Without obstacles: the pressure is carried, and the finer wall gives a little."""
    coarse = hollow_cube()
    fine = MeshTet(coarse.p, coarse.t).refined()
    checkpoints = []
    equilibrium_path(filled(coarse), (1.0,), on_checkpoint=checkpoints.append)
    systems = [System(filled(mesh), NewtonSettings()) for mesh in (coarse, fine)]
    state = carried(systems[0], checkpoints[-1].state, systems[1], onto(coarse, fine))
    assert state.x[-1] == checkpoints[-1].state.x[-1] > 0.0 and state.pressure.shape[0] == 0
    whole = equilibrium_path(filled(fine), (1.0,))[-1]
    ended = continued(systems[1], state)
    assert apart(systems[1], ended, whole) < 1e-5
    assert ended.x[-1] == pytest.approx(float(whole.cavity_pressure[0]), rel=1e-5)
