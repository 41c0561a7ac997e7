"""A reference on nested meshes, on a small clamped ball: right within its bar, at every checkpoint, kept whole."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Sphere, Trajectory
from reference_fem import NewtonSettings, SolveError, equilibrium_path
from reference_fem.statics.newton import StepFailed
from studies.base.errors import StudyError
from studies.reference import nested
from studies.reference import solve as module
from studies.reference.load import load_reference
from studies.reference.nested import GROWTH, solve_nested, targets
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.solve import VARIANTS, solve
from studies.scene.library import BALL_CLAMPED
from studies.scene.library.ball_clamped import RADIUS
from studies.scene.scene import ForceOutput, ReferencePlan
from studies.store.record import Status, read_record
from tests.campaigns import campaign

TRUTH = 4.227
"""Force at the end [N], within .05 %: meridians of NGSolve and of our own (docs/theory.md, section 6)."""
PLAN = ReferencePlan(base=60, at_contact=0, most=8e3, tolerance=1e-4, variants=("steps", "kappa"))
SCENE = replace(BALL_CLAMPED, checkpoints=(2.0, 4.0), reference=PLAN)
SMALL = replace(SCENE, reference=replace(PLAN, most=4e3, variants=()))
"""The same on three meshes."""


@pytest.fixture(scope="module")
def family(mesh_cache):
    """All solutions of the ball."""
    return solve_nested(SCENE, VARIANTS)


@pytest.fixture(scope="module")
def ball(family, tmp_path_factory):
    """Its reference, stored and read back."""
    root = tmp_path_factory.mktemp("nested")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "solve_nested", lambda scene, variants: family)
        solve(root, ReferenceSolve(SCENE))
    return load_reference(root, SCENE)


def test_the_bar_holds_the_true_force_and_is_not_idle(ball):
    """Coarse meshes are too stiff by .9 %, and their bar is 1.8 %."""
    error = ball.force[-1] / TRUTH - 1
    assert 0.003 < error < ball.total_uncertainty["force_end"] < 5 * error


def test_the_meshes_grow_in_even_steps_up_to_the_plans_most(ball):
    """Bisection stops a few elements late."""
    unknowns = np.array([one.unknowns for one in ball.meshes])
    assert len(unknowns) == 4 and (unknowns[:-1] / unknowns[1:] < 1.15 * GROWTH).all()
    assert 0.9 * PLAN.most < unknowns[0] < 1.15 * PLAN.most
    assert ball.record.attributes["unknowns"] == unknowns[0]
    assert ball.record.attributes["off_shape"] == 0 and ball.record.attributes["stopped"] == ""


def test_force_approaches_the_truth_from_mesh_to_mesh(ball):
    off = [abs(one.force[-1] / TRUTH - 1) for one in ball.meshes]
    assert (np.diff(off) > 0).all() and off[0] < 0.15 * off[-1]


def test_every_mesh_is_solved_at_every_checkpoint(ball):
    for one in (*ball.meshes, *ball.variants.values()):
        assert np.isfinite(one.force).all() and one.force.shape == (2,)
    np.testing.assert_array_equal(ball.meshes[0].force, ball.force)
    assert list(ball.variants) == ["steps", "kappa"]
    assert {one.unknowns for one in ball.variants.values()} == {ball.meshes[-1].unknowns}


def check_path(scene, family, within, settings=NewtonSettings()):  # noqa: B008
    """Every checkpoint of the finest mesh is the equilibrium of a path from rest, at tighter tolerances."""
    path = equilibrium_path(family.problem, scene.checkpoints, settings)
    assert [one.t for one in family.equilibria] == list(scene.checkpoints)
    for one, other in zip(path, family.equilibria, strict=True):
        assert np.abs(one.u - other.u).max() < within * np.abs(one.u).max()
        for name in ("held_force", "obstacle_force"):
            largest = within * np.abs(path[-1].held_force).max()
            np.testing.assert_allclose(getattr(other, name), getattr(one, name), rtol=0, atol=largest)
    return [sum(one.newton_iterations for one in each) for each in (path, family.equilibria)]


def test_every_checkpoint_is_the_equilibrium_of_a_path_from_rest(family, ball):
    """Within 1e-4, the tolerance of the finer meshes, in fewer iterations; and they are stored."""
    by_path, nested_ones = check_path(SCENE, family, 1e-4)
    assert nested_ones < by_path and ball.field("newton").sum() == nested_ones
    for moved, one in zip(ball.field("displacement"), family.equilibria, strict=True):
        np.testing.assert_array_equal(moved, one.u)


def test_solutions_are_compared_at_the_vertices_of_the_coarsest_mesh(family, ball):
    """They are the first nodes of every mesh, so nothing is interpolated."""
    count = len(ball.at.points)
    assert count == ball.at.tetrahedra.max() + 1
    np.testing.assert_allclose(ball.field("nodes")[:count], ball.at.points, rtol=0, atol=1e-9 * RADIUS)
    np.testing.assert_allclose(ball.meshes[0].u, ball.field("displacement")[-1, :count], rtol=0, atol=1e-9 * RADIUS)
    assert np.ptp([one.u for one in ball.meshes], axis=0).max() > 1e-3 * RADIUS


def test_bars_are_of_all_that_the_scene_compares(ball):
    assert {"force", "force_end", "surface", "interior", "surface_mean", "silhouette"} < set(ball.uncertainty)
    for name, bar in ball.uncertainty.items():
        assert set(bar.shares) == {"mesh", "steps", "kappa"} and bar.shift == 0.0
        assert bar.shares["steps"] < 1e-3 * (1 if name != "pressure" else 10), name
    assert 0 < ball.uncertainty["volume"].shares["kappa"] < 1e-2


def test_refinement_ends_when_the_bars_are_within_the_tolerance(mesh_cache):
    """After three meshes at the earliest, or there is no bar of three."""
    loose = solve_nested(replace(SMALL, reference=replace(SMALL.reference, tolerance=0.9, most=2e4)), VARIANTS)
    assert len(loose.samples) == 3 and loose.samples[0].unknowns < 1e4 and loose.stopped == ""


@pytest.mark.parametrize(("first", "most", "count"), [(1000, 2500, 1), (1000, 2501, 2), (6216, 60e3, 3), (100, 1e5, 8)])
def test_targets_are_even_steps_that_end_at_most(first, most, count):
    sizes = targets(first, most)
    assert len(sizes) == count and sizes[-1] == pytest.approx(most, rel=1e-12)
    ratios = np.array(sizes) / [first, *sizes[:-1]]
    np.testing.assert_allclose(ratios, ratios[0], rtol=1e-12)
    assert 1 < ratios[0] <= GROWTH * (1 + 1e-9)
    assert targets(1000, 1000.0) == targets(1000, 10.0) == [1500.0]  # one mesh alone has no error bar


def failing_from(monkeypatch, name, number, error):
    """Makes a function of the module fail from its call `number` on, counted from 0."""
    true, calls = getattr(nested, name), []

    def call(*arguments, **options):
        calls.append(arguments)
        if len(calls) > number:
            raise error
        return true(*arguments, **options)

    monkeypatch.setattr(nested, name, call)


def test_without_an_equilibrium_refinement_stops_and_names_the_reason(mesh_cache, tmp_path, monkeypatch):
    """The finest mesh that was solved is the reference, with the bar of those that there are."""
    failing_from(monkeypatch, "refined", 1, SolveError("25 iterations left too much"))
    record = read_record(solve(tmp_path, ReferenceSolve(SMALL)))
    assert record.status == Status.OK
    assert record.attributes["stopped"] == ("the mesh of about 4000 unknowns is left out: 25 iterations left too much")
    reference = load_reference(tmp_path, SMALL)
    assert len(reference.meshes) == 2 and np.isfinite(reference.force).all()
    assert record.attributes["unknowns"] == reference.meshes[0].unknowns < 2500
    assert reference.total_uncertainty["force_end"] > 0.03


def test_the_coarsest_mesh_alone_is_no_reference(mesh_cache, tmp_path, monkeypatch):
    """It was stored as ok, and ended every table of its study, because it has no uncertainty."""
    failing_from(monkeypatch, "refined", 0, SolveError("it folds"))
    assert read_record(solve(tmp_path, ReferenceSolve(SMALL))).status == Status.NOT_CONVERGED
    with pytest.raises(StudyError, match=r"only the coarsest mesh was solved, .* unknowns is left out: it folds"):
        load_reference(tmp_path, SMALL)


@pytest.mark.parametrize("number", [campaign(0), 3])
def test_a_mesh_whose_carried_states_lead_nowhere_is_solved_from_rest(mesh_cache, monkeypatch, number):
    """All of its checkpoints, whether the last one fails or another."""
    failing_from(monkeypatch, "continued", number, StepFailed("made to fail"))
    solution = solve_nested(SMALL, VARIANTS)
    assert (solution.failure, solution.stopped, len(solution.samples)) == ("", "", 3)
    check_path(SMALL, solution, 1e-4)


def test_a_base_that_breaks_off_is_stored_and_not_believed(mesh_cache, tmp_path, monkeypatch):
    reached = equilibrium_path(nested.problem_of(nested.base_mesh(SMALL, 60, 0)), SMALL.checkpoints[:1])
    failing_from(monkeypatch, "equilibrium_path", 0, SolveError("it folds", converged=reached))
    record = read_record(solve(tmp_path, ReferenceSolve(SMALL)))
    assert (record.status, record.message, record.attributes["steps_done"]) == (Status.NOT_CONVERGED, "it folds", 1)
    force = record.fields["held_force"].values
    assert np.isfinite(force[0]).all() and np.isnan(force[1]).all()
    with pytest.raises(StudyError, match="not-converged: it folds"):
        load_reference(tmp_path, SMALL)


def ball_under(friction):
    """A sphere on the pole of a ball that is held below."""
    way = Trajectory((0.0, 3.0), ((0.0, 0.0, 0.0), (0.0, 0.0, -0.15 * RADIUS)))
    return replace(
        SMALL,
        name="ball_probed",
        held=BALL_CLAMPED.held[:1],
        obstacles=(Sphere((0.0, 0.0, 1.82 * RADIUS), 0.8 * RADIUS, way, friction),),
        probed=ForceOutput("obstacle", 0, (0.0, 0.0, -1.0)),
    )


@pytest.mark.parametrize(
    ("friction", "within", "settings"),
    [(0, 2e-3, NewtonSettings(penetration_tol=1e-5)), campaign("no_slip", 5e-3, NewtonSettings())],
)
def test_contact_is_solved_on_every_mesh(mesh_cache, friction, within, settings):
    """Within how far points may sink in, and slip from step to step; without slip by a path from rest on each mesh, as
    what an obstacle holds depends on its way."""
    scene = ball_under(friction)
    solution = solve_nested(scene, VARIANTS)
    assert (solution.stopped, solution.failure, len(solution.samples)) == ("", "", 3)
    check_path(scene, solution, within, settings)
