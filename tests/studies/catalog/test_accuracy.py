"""The campaign has every scene with a reference, a ladder of bodies, and no case that is refused."""

import pytest

from massspring import ImplicitVolume
from studies.catalog import STUDIES
from studies.catalog.accuracy import (
    ACCURACY,
    COARSE_STEP,
    LONG,
    can_be_graded,
    even,
    graded,
    headline,
    is_adaptive,
    judged_at_rest,
    mixed,
)
from studies.catalog.work_precision import WORK_PRECISION
from studies.meshing.graded_mesh import usual_grading
from studies.reference.adaptive_mesh import why_not
from studies.runs.quadratic import check_masses
from studies.runs.recipes import ADAPTIVE, neighbours
from studies.scene.library import JUDGED
from studies.scene.quantities import allowed
from studies.store.paths import readable

HEAVIER = {"ball_clamped", "liver_press", "liver_probe", "kidney_probe", "spleen_sag"}
"""Slow scenes of solid organs that are held."""


def of(scene):
    return [case for case in ACCURACY.cases if case.scene == scene]


def test_it_has_every_scene_of_which_force_or_displacement_is_compared():
    compared = [s for s in JUDGED if allowed(s, "force_end") or allowed(s, "surface_mean")]
    assert list(ACCURACY.scenes) == compared == list(judged_at_rest())
    assert (
        ACCURACY in STUDIES and not ACCURACY.main and {"force_end", "mean_error", "real_time"} <= set(ACCURACY.columns)
    )
    names = [readable(case.name) for case in ACCURACY.cases]
    assert len(set(names)) == len(names)
    assert all(case.timed for case in ACCURACY.cases if case.body.kind != "quadratic")


@pytest.mark.parametrize("scene", judged_at_rest(), ids=lambda scene: scene.name)
def test_every_rung_has_two_sizes_and_nothing_that_the_scene_refuses(scene):
    rungs = {}
    for case in of(scene):
        check_masses(scene, case.body)
        assert scene.skip(case.method.name) is None
        body = case.body
        rungs.setdefault((body.kind, body.graded, body.volumes, body.law), set()).add(body.nodes)
    assert len(rungs) == 6 + bool(graded(scene)) + len({body.graded for body in mixed(scene)})
    assert all(len(sizes) >= 2 for sizes in rungs.values())


@pytest.mark.parametrize("scene", judged_at_rest(), ids=lambda scene: scene.name)
def test_every_quadratic_recipe_runs_on_five_meshes_of_which_one_is_timed(scene):
    quadratic = [case for case in of(scene) if case.method == ImplicitVolume() and case.body.kind == "quadratic"]
    recipes = [*even(scene), *graded(scene), *mixed(scene)]
    assert {case.body for case in quadratic} == {mesh for body in recipes for mesh in neighbours(body)}
    assert [case.body for case in quadratic if case.timed] == recipes and headline(scene) == (
        graded(scene) or even(scene)
    )[-1]
    assert len(quadratic) == 5 * len(recipes) and {case.dt_fraction for case in quadratic} == {LONG}
    assert {case.body.mass for case in quadratic} == {"heavy" if scene.name in HEAVIER else "stiffness"}


@pytest.mark.parametrize("scene", judged_at_rest(), ids=lambda scene: scene.name)
def test_a_solution_grades_the_bodies_of_the_scenes_that_have_one(scene):
    assert is_adaptive(scene) == (why_not(scene) is None)
    assert {body.graded for body in graded(scene)} == {ADAPTIVE if is_adaptive(scene) else True}


@pytest.mark.parametrize("scene", judged_at_rest(), ids=lambda scene: scene.name)
def test_elements_run_beside_the_springs(scene):
    """Explicit ones on the larger linear body; implicit ones on coarse bodies where no lumen is filled."""
    elements = [case for case in of(scene) if case.method != ImplicitVolume()]
    explicit = [case.body for case in elements if case.method.name == "explicit_elements"]
    implicit = {case.body.kind: case.dt for case in elements if case.method.name == "implicit_elements"}
    linear = [case.body for case in of(scene) if case.body.volumes == "nodal"]
    assert [body.nodes for body in explicit] == [max(body.nodes for body in linear)]
    assert set(implicit) == (set() if scene.filled else {"tetrahedral", "quadratic"})
    assert set(implicit.values()) <= {COARSE_STEP} and len(elements) == 1 + len(implicit)


def test_the_small_cut_holds_cases_of_the_campaign():
    assert {case.key for case in WORK_PRECISION.cases} <= {case.key for case in ACCURACY.cases}
    assert {case.body.kind for case in WORK_PRECISION.cases} == {"surface", "tetrahedral", "quadratic"}


@pytest.mark.parametrize("scene", judged_at_rest(), ids=lambda scene: scene.name)
def test_bodies_are_graded_where_grading_changes_them(scene):
    at_outlines, at_contact = usual_grading(scene)
    assert can_be_graded(scene) == bool((at_outlines and scene.held) or (at_contact and scene.obstacles))
    assert any(case.body.graded for case in of(scene)) == (can_be_graded(scene) or is_adaptive(scene))
