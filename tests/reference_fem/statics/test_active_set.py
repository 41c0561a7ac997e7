"""The linearised contact problem of a Newton step: settled to the end, with one factorisation."""

import numpy as np
import pytest

from reference_fem import Cavity, NeoHookean, NewtonSettings, PrescribedDisplacement, Problem, RigidPlane, RigidSphere
from reference_fem.elements.surface import point_positions
from reference_fem.statics import active_set, newton
from reference_fem.statics.equilibrium import equilibrium_path
from reference_fem.statics.tangent import Tangent
from reference_fem.system.saddle_point import System
from reference_fem.system.state import Loads
from tests.reference_fem.bodies import block
from tests.reference_fem.model.test_cavity import hollow_cube, in_the_middle

SINK = 0.03
"""How far the obstacles move at once, a tenth of an edge."""


def pressed(obstacle=None):
    """A block about to be pressed by a tilted plane, and where the plane will be."""
    plane = RigidPlane((1.0, 0.0, 1.0), (-0.05, 0.03, -1.0), lambda t: (0.0, 0.0, -SINK * t))
    ball = RigidSphere((0.4, 0.45, 1.51), 0.5, lambda t: (0.0, 0.0, -SINK * t))
    obstacles = {None: (plane, ball), "plane": (plane,), "ball": (ball,)}[obstacle]
    return Problem(
        block((4, 4, 4), 0.1), NeoHookean(1.0, 1000.0), [PrescribedDisplacement(lambda x: x[2] < 1e-9)], obstacles
    )


def first_step(problem):
    """(system, loads at t = 1, evaluation that the first direction is taken from)."""
    system = System(problem, NewtonSettings())
    rest = system.rest()
    loads = Loads(0.0, system.obstacles_at(1.0), rest.multiplier)
    return system, loads, newton.first_guess(system, rest, loads)


def imbalance(system, evaluation, x, change):
    """Forces left by a change in the linearised problem on the free unknowns, put together apart from the solver.

    Element residual and tangent without contact, and of each point w max(0, m - eps (g + n·d)) n N.
    """
    bare = system.evaluate(x, Loads(0.0, system.rows[:0], np.zeros((0, *system.surface.weights.shape))))
    free, touch = system.pattern.free, evaluation.touch
    upper = system.pattern.upper(bare.values)
    d = change[free]
    left = bare.residual[free] + upper @ d + upper.T @ d - upper.diagonal() * d
    points = active_set.points_near(system, touch, x, change)
    gap = points.gap + points.directions @ change
    t = np.maximum(0.0, points.multiplier - points.penalty * gap)
    return left - points.directions[:, free].T @ (points.area * t), t, points


@pytest.mark.parametrize("guessed", [False, True])
def test_a_settled_change_solves_the_linearised_contact_problem(guessed):
    """From rest, where nothing touches; and from a tangent that counts points wrongly, as the guess says.

    A flat obstacle: its tangent has no curvature that the linearised problem would leave out.
    """
    system, loads, evaluation = first_step(pressed("plane"))
    x = np.zeros(system.total)
    if guessed:
        guess = np.random.default_rng(0).random(loads.multiplier.shape)
        guess[(guess < 0.7) | (point_positions(x, system.surface)[..., 2] < 0.9)] = 0.0
        evaluation = system.evaluate(x, loads._replace(guess=guess))
    tangent = Tangent(system, evaluation)
    plain = tangent.newton(np.zeros(len(system.pattern.held)), active_set.excess(system, evaluation, x))
    change, pressure, _ = active_set.settled(system, tangent, x, plain)
    left, t, points = imbalance(system, evaluation, x, change)
    scale = np.sum(points.area * t)
    assert np.count_nonzero(t) > 20  # there is contact, though the tangent saw none or another
    assert np.count_nonzero((t > 0.0) != points.touching) > 20
    assert np.linalg.norm(left) < 1e-9 * scale  # round-off of a back-solve
    assert np.linalg.norm(imbalance(system, evaluation, x, plain)[0]) > 0.1 * scale
    np.testing.assert_allclose(pressure[points.place], t, rtol=0.0, atol=1e-9 * t.max())


def test_the_potential_falls_with_every_share():
    """The share of a change is where the slope of the potential vanishes, or the whole."""
    system, _, evaluation = first_step(pressed())
    x = np.zeros(system.total)
    tangent = Tangent(system, evaluation)
    points = active_set.points_near(system, evaluation.touch, x, tangent.newton(np.zeros(len(system.pattern.held))))
    influence = active_set.Influence(system, tangent, points)
    chosen = np.flatnonzero(points.gap < 0.0)
    moves = influence.of(chosen)
    for size in (1e-6, 1.0):
        more = np.zeros(len(points.gap))
        more[chosen] = size * points.area[chosen]
        moved = moves @ more[chosen]
        nothing = np.zeros(len(more))
        share = active_set.share_of(points, nothing, more, points.gap, moved)

        def potential(s, more=more, moved=moved):
            t = active_set.pressures(points, points.gap + s * moved)
            return 0.5 * s**2 * more @ moved + np.sum(points.area * t**2 / (2.0 * points.penalty))

        values = [potential(s) for s in np.linspace(0.0, 1.0, 1001)]
        assert share == pytest.approx(np.argmin(values) / 1000.0, abs=2e-3)  # bisected to a thousandth
        assert (share == 1.0) == (size == 1e-6)


def test_many_right_hand_sides_answer_like_one_by_one():
    """With a cavity, whose border each column has to satisfy."""
    problem = Problem(
        hollow_cube(),
        NeoHookean(1.0, 1000.0),
        [PrescribedDisplacement(lambda x: x[2] < 1e-9)],
        cavities=[Cavity(in_the_middle)],
    )
    system = System(problem, NewtonSettings())
    state = system.rest()
    evaluation = system.evaluate(state.x, Loads(0.0, system.rows, state.multiplier, system.filling_at(0.0, 1.0)))
    tangent = Tangent(system, evaluation)
    forces = np.random.default_rng(1).standard_normal((len(system.pattern.free), 3))
    together = tangent.respond(forces)
    for column, force in zip(together.T, forces.T, strict=True):
        np.testing.assert_allclose(column, tangent.respond(force), rtol=0.0, atol=1e-9 * np.abs(together).max())
    volume_change = evaluation.gradients @ together[: system.field_count]
    scale = np.abs(evaluation.gradients).sum() * np.abs(together).max()
    assert np.abs(volume_change).max() < 1e-9 * scale
    assert np.abs(together[-1]).max() > 0.0  # the pressure of the lumen took part


def test_few_newton_iterations_and_the_answer_of_plain_newton(monkeypatch):
    """Five load steps under a tilted plane and a ball; the issue asks for a median of 6 at most."""
    times = np.arange(1, 6) / 2.5
    problem = pressed()
    settled = equilibrium_path(problem, times)
    monkeypatch.setattr(
        active_set, "settled", lambda system, tangent, x, change: (change, np.zeros((0, 0, 0)), np.zeros((0, 0)))
    )
    plain = equilibrium_path(problem, times)
    assert np.median([state.newton_iterations for state in settled]) <= 5.0
    assert np.median([state.newton_iterations for state in plain]) >= 7.0
    for one, other in zip(settled, plain, strict=True):
        # both are allowed to sink in by 3e-4 of the displacement
        np.testing.assert_allclose(one.obstacle_force, other.obstacle_force, rtol=0.0, atol=2e-3 * 0.1)
        assert one.penetration <= 3e-4 * np.abs(one.u).max()
