"""Bodies whose elements are small where a solution of their coarse mesh has its errors."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from massspring import Sphere, Trajectory
from reference_fem import nodes
from reference_fem.system.saddle_point import System
from studies.base.errors import StudyError
from studies.geometry.mesher.jobs import cached
from studies.meshing.graded_mesh import outer_nodes
from studies.meshing.held_mesh import held_mesh
from studies.meshing.kept_shape import held_area_error
from studies.meshing.nested_mesh import edges_of, marked
from studies.meshing.scene_mesh import mesh_for
from studies.reference import adaptive_mesh as module
from studies.reference.adaptive_mesh import STRAIN, adapted, adaptive_mesh, coarse_mesh, indicators_of, least_edge
from studies.runs.prepare import mesh_of
from studies.runs.recipes import QuadraticBody
from studies.scene.library import BALL_CLAMPED, BALL_RINGING, BALL_SQUEEZE, LIVER_PROBE

NODES = 594
BODY = QuadraticBody(NODES, graded="adaptive", mass="stiffness")


@pytest.fixture(scope="module")
def solved(mesh_cache):
    """The mesh, and the error indicator that it comes from."""
    entries = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "cached", lambda *arguments: entries.append(cached(*arguments)) or entries[0])
        mesh = mesh_of(LIVER_PROBE, BODY)
    return mesh, entries[0]["indicator"]


@pytest.fixture(scope="module")
def mesh(solved):
    return solved[0]


def test_it_has_as_many_nodes_as_its_recipe_says_and_stands_upright(mesh):
    assert NODES <= mesh.outer_count <= 1.06 * NODES and mesh.smallest_jacobian > 0.0
    assert abs(held_area_error(LIVER_PROBE, mesh, LIVER_PROBE.held[0])) < 0.03


def test_elements_are_small_under_the_probe_and_at_the_outline(mesh):
    """Those near the probe or the outline are smaller than the rest by more than one halving."""
    corners = mesh.points[mesh.cells[:, :4]]
    size = np.cbrt(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])))
    middle = corners.mean(axis=1)
    probe, region = LIVER_PROBE.obstacles[-1], LIVER_PROBE.held[0].region
    under = probe.gap(middle, LIVER_PROBE.checkpoints[-1]) < 0.01
    far = ~under & (probe.gap(middle, LIVER_PROBE.checkpoints[-1]) > 0.03) & (np.abs(region.level(middle)) > 0.03)
    assert under.sum() > 5 and far.sum() > 20
    assert np.median(size[under]) < 0.75 * np.median(size[far])


def test_it_is_solved_once_and_the_same_again(mesh, monkeypatch):
    monkeypatch.setattr(module, "indicators_of", lambda *_: pytest.fail("solved again"))
    again = adaptive_mesh(replace(LIVER_PROBE, name="other", title="other", reference=None), NODES)
    assert np.array_equal(again.points, mesh.points) and np.array_equal(again.cells, mesh.cells)


def test_the_largest_indicators_are_halved_first():
    coarse = held_mesh(BALL_CLAMPED, mesh_for(BALL_CLAMPED, 60))
    wished = np.zeros(coarse.mesh.nelements)
    wished[7] = 1.0
    body = adapted(coarse, wished, outer_nodes(coarse, quadratic=True) + 3)
    middle = coarse.mesh.p[:, coarse.mesh.t].mean(axis=1).T
    new = body.mesh.p[:, coarse.mesh.nvertices :].T
    near = np.linalg.norm(middle - middle[7], axis=1) < np.quantile(np.linalg.norm(middle - middle[7], axis=1), 0.5)
    assert len(new) and np.linalg.norm(new - middle[7], axis=1).max() < np.linalg.norm(middle - middle[7], axis=1).max()
    assert near.any() and outer_nodes(body, quadratic=True) >= outer_nodes(coarse, quadratic=True) + 3


def test_the_indicator_belongs_to_the_elements_of_the_coarse_mesh(solved):
    _, coarse = coarse_mesh(LIVER_PROBE, NODES)
    indicator = solved[1]
    assert indicator.shape == (coarse.mesh.nelements,) and indicator.max() == 1.0 and indicator.min() >= 0.0
    # Half of the error is in few elements, or it would say nothing.
    assert np.sort(indicator)[::-1][: len(indicator) // 5].sum() > 0.5 * indicator.sum()


def test_the_stretch_of_a_uniform_deformation_is_its_largest(monkeypatch):
    organ_mesh, coarse = coarse_mesh(BALL_CLAMPED, NODES)
    gradient = np.array([[1.1, 0.3, 0.0], [0.0, 0.9, -0.2], [0.1, 0.0, 1.05]])

    def moved(problem, *_, on_checkpoint):
        x = np.zeros(System(problem, module.LOOSE).total)
        rest = nodes(problem.mesh)
        x[: rest.size] = (rest @ (gradient - np.eye(3)).T).ravel()
        on_checkpoint(SimpleNamespace(state=SimpleNamespace(x=x)))

    monkeypatch.setattr(module, "equilibrium_path", moved)
    _, stretch = indicators_of(BALL_CLAMPED, organ_mesh, coarse, coarse)
    assert stretch == pytest.approx(np.full(coarse.mesh.nelements, np.linalg.norm(gradient, 2)), rel=1e-12)


def test_elements_at_an_outline_stop_where_the_stretch_would_be_too_large():
    coarse = held_mesh(BALL_CLAMPED, mesh_for(BALL_CLAMPED, 100))
    there = coarse.at_outlines()
    edge = edges_of(coarse.mesh.p.T, coarse.mesh.t.T)
    stretch = np.ones(coarse.mesh.nelements)
    assert least_edge(coarse, stretch) == 0.0
    stretch[there] = 1.0 + 0.5 * STRAIN
    assert least_edge(coarse, stretch) == pytest.approx(edge[there].max() / 4)  # four times smaller, twice the stretch
    stretch[np.setdiff1d(np.arange(len(stretch)), there)] = 5.0
    assert least_edge(coarse, stretch) == pytest.approx(edge[there].max() / 4)

    wished = np.where(np.isin(np.arange(len(edge)), there), 1.0, 1e-3)
    free, kept = (marked(coarse, wished, 4 * len(edge), least)[0] for least in (0.0, 0.4 * edge[there].max()))
    assert len(kept.at_outlines()) < 0.9 * len(free.at_outlines())
    assert free.mesh.nelements > 3 * len(edge) < kept.mesh.nelements
    assert marked(coarse, wished * (wished == 1.0), 4 * len(edge), 10.0)[0].mesh.nelements == len(edge)
    with pytest.raises(StudyError, match="no element is left to halve"):
        adapted(coarse, wished * (wished == 1.0), 10_000, 10.0)


def test_a_coarse_mesh_that_loses_what_is_held_is_left_for_a_finer_one(monkeypatch):
    lost = {level: 20.0 for level in range(1000)}
    first = round((0.7 * NODES + 6) / 4)
    levels = []
    monkeypatch.setattr(module, "lost_area", lambda _, level: levels.append(level) or lost[level])
    lost[round(1.08 * first)] = 1.0
    coarse_mesh(BALL_CLAMPED, NODES)
    assert levels == [first, round(1.08 * first)]


def test_a_thin_tool_does_not_slip_through_the_coarse_body(mesh_cache):
    """A sphere of 3 mm radius, pushed in by 6 mm: whole, the coarse body has facets with sides of 26 mm."""
    radius, top = 0.003, BALL_CLAMPED.organ.parameters["radius"]
    path = Trajectory((0.0, BALL_CLAMPED.checkpoints[-1]), ((0.0, 0.0, 0.0), (0.0, -0.006, 0.0)))
    tool = Sphere((0.0, top + radius, 0.0), radius, path)
    scene = replace(BALL_CLAMPED, held=BALL_CLAMPED.held[:1], obstacles=(tool,))
    organ_mesh, whole = coarse_mesh(scene, 400)
    with pytest.raises(StudyError, match="slips through"):
        indicators_of(scene, organ_mesh, whole, whole)
    assert 400 <= adaptive_mesh(scene, 400).outer_count < 420


@pytest.mark.parametrize(
    ("scene", "reason"),
    [(BALL_SQUEEZE, "nothing holds"), (BALL_RINGING, "nothing holds|no static")],
    ids=lambda one: getattr(one, "name", ""),
)
def test_scenes_without_such_a_solution_are_refused_by_name(scene, reason):
    with pytest.raises(StudyError, match=rf"'{scene.name}' has no adaptive bodies: .*({reason}).*; choose graded=True"):
        mesh_of(scene, BODY)


def test_a_body_that_is_let_go_before_the_end_is_a_sentence(mesh_cache):
    """Not that too many nodes are asked for: no element has an error."""
    bottom, top = BALL_CLAMPED.held
    back = Trajectory((0.0, 1.0, 2.0), ((0.0, 0.0, 0.0), (0.0, 0.0, -0.005), (0.0, 0.0, 0.0)))
    with pytest.raises(StudyError, match="not deformed at the last checkpoint; end with a checkpoint under load"):
        adaptive_mesh(replace(BALL_CLAMPED, held=(bottom, replace(top, path=back))), 300)


def test_a_coarse_body_without_an_equilibrium_is_a_sentence(monkeypatch):
    from reference_fem import SolveError

    def fails(*_, **__):
        raise SolveError("no step")

    monkeypatch.setattr(module, "equilibrium_path", fails)
    organ_mesh, coarse = coarse_mesh(LIVER_PROBE, NODES)
    with pytest.raises(StudyError, match=r"no solution by which to adapt \(no step\); choose graded=True"):
        indicators_of(LIVER_PROBE, organ_mesh, coarse, coarse)
