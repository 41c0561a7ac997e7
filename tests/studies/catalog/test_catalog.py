"""Every study has a question, cases that can be prepared, names that exist, and a smoke version."""

import numpy as np
import pytest

from massspring import LITERATURE
from studies.base.errors import DoesNotApply, StudyError
from studies.catalog import STUDIES
from studies.catalog.study import SMOKE_FRAMES, SMOKE_NODES, SMOKE_NODES_CUT, SMOKE_NODES_HOLLOW, SMOKE_QUADRATIC
from studies.metrics.table import metric
from studies.runs.prepare import prepare
from studies.runs.recipes import SurfaceBody
from studies.store.paths import readable
from studies.sweep.find_study import MAIN, find_studies, find_study
from tests.campaigns import campaigns_but
from tests.studies.tiny import tiny_case, tiny_study

TIMES = {"step_time", "frame_time", "frame_time_p99", "frame_cpu", "real_time", "real_time_cpu"}


@pytest.fixture(params=STUDIES, ids=lambda study: study.name)
def study(request):
    return request.param


def test_names_can_be_folders_and_are_unique():
    names = [study.name for study in STUDIES]
    assert len(set(names)) == len(names)
    assert [readable(name) for name in names] == names


def test_the_main_studies_run_where_none_is_named():
    main = [study for study in STUDIES if study.main]
    assert find_studies([]) == find_studies([MAIN]) == main != []
    assert find_studies(["stress", MAIN]) == [find_study("stress"), *main]
    assert MAIN not in [study.name for study in STUDIES]
    with pytest.raises(StudyError, match="cannot be called 'main'"):
        tiny_study(name=MAIN)


def test_it_asks_a_question(study):
    first = study.question.strip().split("\n")[0]
    assert "?" in first
    assert len(first) <= 120


def test_cases_are_distinct_and_scenes_of_one_name_are_one(study):
    assert study.cases
    assert len({case.key for case in study.cases}) == len(study.cases)
    assert all(case.scene == scene for scene in study.scenes for case in study.cases if case.scene.name == scene.name)


def test_columns_are_metrics_and_times_are_measured(study):
    assert [metric(name).name for name in study.columns] == list(study.columns)
    if TIMES & set(study.columns):
        assert any(case.timed for case in study.cases)


def test_charts_have_files_of_their_own(study):
    files = [chart.file for chart in study.charts]
    assert files
    assert len(set(files)) == len(files)
    assert all(file.endswith(".png") and callable(chart.draw) for file, chart in zip(files, study.charts, strict=True))


def test_no_case_uses_a_method_that_its_scene_skips(study):
    assert [case.scene.skip(case.method) for case in study.cases] == [None] * len(study.cases)


def test_smoke_is_small_and_still_the_same_question(study):
    smoke = study.smoke()
    assert smoke.name == study.name
    assert {case.method for case in smoke.cases} == {case.method for case in study.cases}
    assert {case.scene.name for case in smoke.cases} == {case.scene.name for case in study.cases}
    assert {case.timed for case in smoke.cases} == {case.timed for case in study.cases}
    for case in smoke.cases:
        few = SMOKE_QUADRATIC if case.body.kind == "quadratic" else (SMOKE_NODES, SMOKE_NODES_CUT, SMOKE_NODES_HOLLOW)
        assert case.body.nodes <= few[2 if case.scene.lumen is not None else 1 if case.scene.cuts else 0]
        assert case.frames <= SMOKE_FRAMES and 3 * case.body.regions <= max(few)  # else a region has hardly a node
        plan = case.scene.reference
        assert plan is None or plan.variants == ()
        assert plan is None or (plan.most <= 12e3 if plan.nested else len(plan.levels) == 2)
    assert smoke.smoke() == smoke


def kind(case):
    """What decides how a case is prepared, but for its scene: the recipe without its numbers of nodes and regions, and
    the method."""
    chosen = {name: value for name, value in case.body.chosen.items() if name not in ("nodes", "regions")}
    return str(chosen), case.method


def representatives(cases):
    """Of each kind the first case: they share their meshes. Every scene is made ready in test_scenes.py."""
    return list({kind(case): case for case in reversed(cases)}.values())


def check_prepared(case):
    try:
        prepared = prepare(case)
    except DoesNotApply as error:  # the literature's methods are cases of every scene
        reason, prepared = str(error), None
    if prepared is None:
        assert type(case.method) in LITERATURE and len(reason) > 40
        return
    clock = prepared.setup.clock
    ended = np.array(case.scene.checkpoints) / clock.frame
    assert clock.frames >= case.frames and np.allclose(ended, ended.round(), rtol=0.0, atol=1e-6)
    assert prepared.setup.clock.duration == pytest.approx(case.scene.duration, rel=1e-12)


QUICK = [case for study in STUDIES if study.name != "organs" for case in study.smoke().cases]
"""The organs take most of a minute to mesh: the campaign below prepares them."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    campaigns_but(representatives(QUICK), lambda case: case.scene.organ.shape == "ball"),
    ids=lambda case: case.name,
)
def test_every_kind_of_case_can_be_prepared(case):
    """Only once, although several studies share the case."""
    check_prepared(case)


@pytest.mark.campaign
def test_every_kind_of_case_can_be_prepared_in_every_scene(study):
    for case in {(case.scene.name, *kind(case)): case for case in study.smoke().cases}.values():
        check_prepared(case)


def test_smoke_drops_what_becomes_the_same():
    """Two mesh sizes above the smoke size are one smoke case, or the same file would be written twice."""
    fine, finer = (tiny_case(body=SurfaceBody(nodes)) for nodes in (550, 1100))
    assert len(tiny_study(cases=(fine, finer)).smoke().cases) == 1
