"""References of scenes and the second judge: what is compared, what is allowed, and what would be seen."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from reference_fem import crosscheck, equilibrium_path, facet_nodes, nodes
from reference_fem.crosscheck import solid
from reference_fem.crosscheck.meridian import MeridianMesh
from studies.geometry.organs.liver import LIVER
from studies.reference.load import reference_for
from studies.reference.sample import parted
from studies.scene.library import BALL_CLAMPED, BALL_INCISED, BALL_SQUEEZE, LIVER_PRESS
from studies.tools.verify import second_judge
from studies.tools.verify.judge_mesh import JudgeMesh, judged_problem
from studies.tools.verify.second_judge import (
    JUDGES,
    Judge,
    OrganSolution,
    ball_of,
    centred,
    halves,
    moving,
    openings_apart,
    second_judges,
    verdict,
)
from tests.studies.octant import SCENE


def test_without_the_other_code_there_is_no_judge(monkeypatch, tmp_path):
    monkeypatch.setattr(crosscheck, "available", lambda: False)
    assert second_judges(tmp_path) == ()


def test_the_judge_has_the_load_of_the_scene():
    """Checkpoints at rest add no step; each step is taken in two; the ball is the scene's."""
    times = moving(BALL_SQUEEZE, BALL_SQUEEZE.obstacles[0].path)
    assert times[-1] == BALL_SQUEEZE.checkpoints[-1]
    assert len(set(np.linalg.norm([BALL_SQUEEZE.obstacles[0].path(t) for t in times], axis=1))) == len(times)
    assert halves([1.0, 3.0]) == [0.5, 1.0, 2.0, 3.0]
    ball = ball_of(BALL_CLAMPED)
    assert ball.radius == 0.05
    assert ball.material.kappa / ball.material.mu == pytest.approx(BALL_CLAMPED.tissue.bulk_over_shear)


def test_the_judge_looks_from_the_middle_between_the_caps():
    """The lower cap stays in the scene and comes up half the push in the judge's frame."""
    end = BALL_CLAMPED.checkpoints[-1]
    push = BALL_CLAMPED.held[1].path(end)
    np.testing.assert_allclose(centred(BALL_CLAMPED, np.stack([np.zeros(3), push])), [-push / 2, push / 2])


def solution(force) -> Any:
    return SimpleNamespace(force=np.array([force]), mesh=SimpleNamespace(ne=7))


@pytest.mark.parametrize(("share", "met"), [(0.0, True), (1.2, True), (1.6, False)])
def test_a_reference_beyond_its_bar_and_the_judges_change_is_off(reference, share, met):
    """The judge is moved away by so many bars; it changes by half a bar from its coarse mesh to its fine one."""
    bar = reference.total_uncertainty["force_end"]
    theirs = reference.force[-1] / (1 + share * bar)
    coarse, fine = MeridianMesh(0.2, 0), MeridianMesh(0.1, 0)
    answers = {coarse: solution(theirs * (1 + bar / 2)), fine: solution(theirs)}
    (check,) = verdict(Judge(SCENE, lambda mesh: answers[mesh], coarse, fine), reference).checks
    assert bool(check.met) is met
    assert check.tolerance == pytest.approx(1.5 * bar, rel=1e-9)


def test_the_judged_scenes_are_named(monkeypatch, tmp_path):
    monkeypatch.setattr(crosscheck, "available", lambda: True)
    monkeypatch.setattr(second_judge, "version", lambda name: "6.2")
    assert [oracle.name for oracle in second_judges(tmp_path)] == [
        "judge_ball_squeeze",
        "judge_ball_clamped",
        "judge_liver_press",
        "judge_ball_incised",
    ]
    assert not any(oracle.fast for oracle in second_judges(tmp_path))


def test_an_organ_is_judged_on_a_mesh_of_its_own_that_lies_on_the_true_shape():
    """No reference has so many surface nodes; the held region is the whole bare area and stays, the plane moves."""
    assert LIVER_PRESS.reference.base not in {judge.nodes for judge in (JUDGES[2].coarse, JUDGES[2].fine)}
    plain, halved = (judged_problem(LIVER_PRESS, JudgeMesh(200, times)) for times in (0, 1))
    assert halved.mesh.nelements > plain.mesh.nelements
    surface = np.unique(facet_nodes(plain.mesh))
    x = nodes(plain.mesh)[surface]
    np.testing.assert_allclose(LIVER.level(x), 0.0, atol=1e-6)
    held = plain.held[0].where(x.T)
    region = LIVER_PRESS.held[0].region
    assert region.level(x[held]).max() < 1e-6
    assert held.sum() > 0.8 * (region.level(x) < -1e-6).sum()
    end = LIVER_PRESS.checkpoints[-1]
    np.testing.assert_allclose(plain.obstacles[0].motion(end), LIVER_PRESS.obstacles[0].path(end))
    assert plain.material.mu == LIVER_PRESS.tissue.shear_modulus


def test_the_force_of_an_organ_is_the_one_that_its_scene_probes():
    """Along the scene's direction, of the obstacle on the body, whatever the body is held with."""
    push = 3.0 * np.asarray(LIVER_PRESS.probed.direction)
    solved: Any = SimpleNamespace(obstacle_force=push[None], held_force=-2 * push[None])
    np.testing.assert_allclose(OrganSolution(LIVER_PRESS, solved).force, [3.0])


@pytest.mark.skipif(not crosscheck.available(), reason="NGSolve is not installed: pip install organbench[crosscheck]")
def test_the_judge_of_a_cut_agrees_with_the_reference_on_one_mesh(monkeypatch):
    """At second order on the same opened mesh: forces, and displacement on either side of every place of the cut."""
    monkeypatch.setattr(solid, "ORDER", solid.PATH_ORDER)
    problem = judged_problem(BALL_INCISED, JudgeMesh(60, 0))
    times = BALL_INCISED.checkpoints
    ours = equilibrium_path(problem, times)[-1]
    theirs = OrganSolution(BALL_INCISED, solid.solve_solid(problem, times))
    np.testing.assert_allclose(theirs.solid.held_force, ours.held_force, atol=1e-3 * np.abs(ours.held_force).max())
    behind, front = parted(nodes(problem.mesh), len(ours.u)).T
    opening = ours.u[front] - ours.u[behind]
    largest = np.abs(opening).max()
    assert largest > 0.1 * BALL_INCISED.organ.parameters["radius"]
    places = nodes(problem.mesh)[behind]
    np.testing.assert_allclose(theirs.opening(places), opening, atol=2e-3 * largest)
    moved = centred(BALL_INCISED, ours.u[behind])
    np.testing.assert_allclose(theirs.displacement(places), moved, atol=2e-3 * largest)


def test_a_judge_that_sees_half_of_the_opening_is_off_by_half():
    """Where the reference's coarsest mesh is parted the two are compared; a published mesh is rounded."""
    reference = reference_for(Path(), BALL_INCISED)
    half, whole = (
        SimpleNamespace(opening=lambda at, share=share: share * reference.opening(at)) for share in (0.5, 1.0)
    )
    apart, change = openings_apart(reference, whole, half)
    assert apart < 0.03
    assert change == pytest.approx(0.5, rel=1e-9)
