"""Advice is the cheapest recipe with errors within the target; it uses measured numbers only."""

from dataclasses import replace

import pytest

import studies
from massspring import Probe
from studies.base.errors import StudyError
from studies.meshing.true_surface import ShapeErrors
from studies.metrics.table import study_table
from studies.metrics.wish import usual_wish
from studies.runs.recipes import BodyRecipe, neighbours
from studies.scene.library import (
    BALL_CLAMPED,
    BALL_SQUEEZE,
    BLADDER_FILL,
    KIDNEY_PROBE,
    LIVER_PRESS,
    LIVER_PROBE,
    SPLEEN_SAG,
    STOMACH_PRESS,
)
from studies.store.record import Status
from studies.store.tables import write_table
from studies.tools.advise import answer as answers
from studies.tools.advise.answer import advise, recommended
from studies.tools.advise.words import lines_of
from tests.studies.plots.made_up import run
from tests.studies.tools.advise.made_up_campaign import EVEN, FINE, GRADED, LADDER, ONE, PAPER, publish, row, rows_of

NAN = float("nan")


@pytest.fixture
def results(tmp_path):
    """A published campaign of one scene."""
    return publish(tmp_path, rows_of(LIVER_PRESS))


@pytest.fixture
def never_timed(monkeypatch):
    """A timing run here would be one too many."""

    def refuse(case):
        raise AssertionError(f"{case.name} was timed")

    monkeypatch.setattr(answers, "short_timing", refuse)


def body(advice):
    return advice.chosen.case.body


def test_the_usual_wish_is_met_by_the_cheapest_that_meets_both_errors(results, never_timed):
    advice = advise("liver_press", results=results)
    assert body(advice) == GRADED and advice.meets and advice.usual
    assert (advice.wish.force, advice.wish.displacement) == (3.0, 1.0)
    assert advice.chosen.force == (-1.2, 0.5) and advice.chosen.displacement == (0.8, 0.1)
    assert advice.real_time == pytest.approx(2.0)
    assert recommended(LIVER_PRESS, results) == (GRADED, 0.8)


@pytest.mark.parametrize(
    ("wish", "chosen"),
    [
        ({"force": 0.03}, EVEN),
        ({"displacement": 0.05}, ONE),
        ({"force": 0.8, "displacement": 0.2}, PAPER),
        ({"force": 0.01}, FINE),
        ({"force": 0.35, "budget": 0.02}, ONE),
        ({"budget": 0.5}, GRADED),
    ],
)
def test_only_what_is_named_counts(results, never_timed, wish, chosen):
    advice = advise(LIVER_PRESS, **wish, results=results)
    assert body(advice) == chosen and advice.meets


@pytest.mark.parametrize(
    ("wish", "nearest"),
    [
        ({"budget": 0.25}, EVEN),  # 1.4 times the displacement; the next is twice as dear
        ({"displacement": 0.002}, FINE),
        ({"force": 0.2, "budget": 0.019}, ONE),
    ],
)
def test_where_none_meets_the_nearest_is_named(results, never_timed, wish, nearest):
    advice = advise(LIVER_PRESS, **wish, results=results)
    assert body(advice) == nearest and not advice.meets and not advice.unknowable


def test_no_error_is_promised_that_the_reference_does_not_know(results, never_timed):
    advice = advise(LIVER_PRESS, force=0.004, results=results)
    assert advice.unknowable == ("force",) and not advice.meets and body(advice) == FINE


def test_a_recipe_that_ended_badly_is_none(tmp_path, never_timed):
    rows = [row(LIVER_PRESS, b, n, status="inverted" if b == GRADED else "ok") for b, n in LADDER.items()]
    assert body(advise(LIVER_PRESS, results=publish(tmp_path, rows))) == FINE


def test_hollow_organs_may_be_farther_off(tmp_path, never_timed):
    assert (usual_wish(STOMACH_PRESS).force, usual_wish(STOMACH_PRESS).displacement) == (6.0, 3.0)
    assert body(advise(STOMACH_PRESS, results=publish(tmp_path, rows_of(STOMACH_PRESS)))) == EVEN


def test_what_a_scene_does_not_compare_is_ignored_by_name(tmp_path, never_timed):
    results = publish(tmp_path, rows_of(SPLEEN_SAG, **{"force_end [%]": NAN, "force_end floor [%]": NAN}))
    advice = advise(SPLEEN_SAG, results=results)
    assert advice.ignored == ("force",) and advice.meets and body(advice) == GRADED
    alone = advise(SPLEEN_SAG, force=0.03, results=results)
    assert alone.chosen is None and not alone.meets and alone.ignored == ("force",)


def test_what_was_published_by_the_writer_of_tables_is_read_back(tmp_path, never_timed):
    """The table of a study keeps every recipe, error and time."""
    options = {"nodes": 994, "fraction": 0.5, "frame_ms": 100.0, "recipe": {"graded": "adaptive", "mass": "heavy"}}
    runs = [run(LIVER_PRESS, "quadratic", error=0.02, **options), run(LIVER_PRESS, error=0.5, frame_ms=50.0)]
    publish(tmp_path, [])
    write_table(tmp_path / "published" / "accuracy" / "accuracy.csv", study_table(runs, ("force_end", "mean_error",
                "real_time")))  # fmt: skip
    advice = advise(LIVER_PRESS, force=0.025, results=tmp_path)
    assert advice.chosen.case == runs[0].case.replaced(timed=False)
    assert advice.chosen.force == pytest.approx((-2.0, 2.0))
    assert advice.chosen.cost.value == pytest.approx(0.1 * 1.02 / (LIVER_PRESS.duration / 40), rel=1e-5)
    assert advice.chosen.dt == pytest.approx(1e-3)


def stored_runs(monkeypatch, *runs):
    """Runs that lie in the results folder, of octahedra that count as livers in shape."""
    monkeypatch.setattr("studies.metrics.run.shape_errors", lambda *given, **options: ShapeErrors(0.0, 0.0))
    keys = [each.case.key for each in runs]
    monkeypatch.setattr(
        "studies.tools.advise.campaign.case_path", lambda root, study, case: case.replaced(recorded=()).key
    )
    monkeypatch.setattr("studies.tools.advise.campaign.is_there", lambda path: path in keys)
    monkeypatch.setattr("studies.tools.advise.campaign.load_runs", lambda root, study: (list(runs), []))


GRADED_RUN = {"nodes": 994, "fraction": 0.8, "frame_ms": 10.0, "recipe": {"graded": "adaptive", "mass": "heavy"}}


def test_a_run_replaces_its_published_row_and_the_others_stay(results, monkeypatch, never_timed):
    stored = run(LIVER_PRESS, "quadratic", error=0.02, **GRADED_RUN)
    stored_runs(monkeypatch, stored)
    advice = advise(LIVER_PRESS, force=0.025, results=results)
    assert advice.chosen.case == stored.case and advice.chosen.force.value == pytest.approx(-2.0)
    assert advice.stored.where == f"{results / 'accuracy'} and {results / 'published' / 'accuracy' / 'accuracy.csv'}"
    assert advice.chosen.cost.uncertainty > 0  # repeats are stored, not only their median
    assert body(advise(LIVER_PRESS, force=0.005, results=results)) == FINE


def test_a_run_that_ended_badly_here_is_not_advised_for_its_published_row(results, monkeypatch, never_timed):
    stored_runs(monkeypatch, run(LIVER_PRESS, "quadratic", status=Status.DIVERGED, **GRADED_RUN))
    assert body(advise(LIVER_PRESS, results=results)) == FINE


def test_a_run_without_a_reference_leaves_its_published_row(results, monkeypatch, never_timed):
    stored_runs(monkeypatch, run(LIVER_PRESS, "quadratic", with_reference=False, **GRADED_RUN))
    advice = advise(LIVER_PRESS, results=results)
    assert body(advice) == GRADED and advice.chosen.force.value == -1.2


def like(scene, **changes):
    return replace(scene, name="mine", title="mine", reference=None, duration=2 * scene.duration, **changes)


def test_a_scene_that_was_never_run_gets_the_worst_of_its_kind(tmp_path, never_timed):
    worse = {b: (2 * f, 0.5 * u, 3 * c) for b, (f, u, c) in LADDER.items() if b != EVEN}
    results = publish(tmp_path, [*rows_of(LIVER_PROBE), *rows_of(KIDNEY_PROBE, worse), *rows_of(LIVER_PRESS)])
    advice = advise(like(LIVER_PROBE), results=results, timing=False)
    assert advice.alike == ("liver_probe", "kidney_probe")
    assert body(advice) == GRADED and advice.chosen.case.scene.name == "mine"
    assert advice.chosen.force.value == pytest.approx(-2.4) and advice.chosen.displacement.value == 0.8
    assert advice.chosen.cost.value == pytest.approx(1.5) and not advice.chosen.timed_here
    strict = advise(like(LIVER_PROBE), force=0.02, results=results, timing=False)
    assert body(strict) == FINE


def test_runs_of_the_scene_of_a_user_count_more_than_those_of_other_scenes(tmp_path, monkeypatch, never_timed):
    results, mine = publish(tmp_path, rows_of(LIVER_PROBE)), replace(LIVER_PROBE, name="mine", duration=9.0)
    stored = run(mine, "quadratic", error=0.02, **GRADED_RUN | {"nodes": 1594})
    stored_runs(monkeypatch, stored)
    advice = advise(mine, results=results, timing=False)
    assert advice.alike == () and advice.stored.where == str(results / "mine")
    assert body(advice).nodes == 1594 and advice.chosen.force.value == pytest.approx(-2.0)
    lines = "\n".join(lines_of(advice))
    assert f"organbench run FILE.py --case {advice.chosen.case.name}" in lines and "on one mesh" in lines


def test_errors_of_other_scenes_say_on_how_many_meshes(tmp_path, never_timed):
    rows = [row(scene, one, LADDER[GRADED]) for scene in (LIVER_PROBE, KIDNEY_PROBE) for one in neighbours(GRADED)]
    advice = advise(like(LIVER_PROBE), results=publish(tmp_path, rows), timing=False)
    assert "the largest of 10 neighbouring meshes of 2 scenes; median 1.2 %" in "\n".join(lines_of(advice))


def test_a_load_beyond_what_was_measured_is_named_and_meets_nothing(results):
    (plane,) = LIVER_PRESS.obstacles

    def pressed(factor):  # as slowly
        rows = tuple(tuple(factor * x for x in row) for row in plane.path.displacements)
        path = replace(plane.path, displacements=rows, times=tuple(factor * t for t in plane.path.times))
        scene = like(LIVER_PRESS, obstacles=(replace(plane, path=path),))
        return replace(scene, duration=factor * LIVER_PRESS.duration)

    within, beyond = (advise(pressed(factor), results=results, timing=False) for factor in (2.0, 6.0))
    assert within.meets and not beyond.meets
    text = "\n".join(lines_of(beyond))
    assert "its loads are larger than any with which errors were measured: planes go into the organ by 0." in text
    assert "its errors are not known; of smaller loads those of the closest candidate are:" in text
    with pytest.raises(StudyError, match=r"measured up to 0\.45"):
        recommended(pressed(6.0), results=results)


def test_the_same_name_with_another_load_was_never_run(results):
    deeper = replace(LIVER_PRESS, duration=9.0)
    assert advise(deeper, results=results, timing=False).alike == ("liver_press",)
    assert advise(replace(LIVER_PRESS, reference=None), results=results, timing=False).alike == ()


def test_even_bodies_stand_for_their_own_organ_alone(results):
    longer, other = like(LIVER_PRESS), like(LIVER_PRESS, organ=KIDNEY_PROBE.organ)
    assert body(advise(longer, force=0.03, results=results, timing=False)) == EVEN
    assert body(advise(other, force=0.03, results=results, timing=False)) == GRADED


def test_masses_that_end_alike_are_one_recipe_and_a_free_organ_does_not_stand_for_a_held_one(tmp_path, never_timed):
    light = {replace(one, mass="stiffness") if one.kind == "quadratic" else one: n for one, n in LADDER.items()}
    rows = [*rows_of(LIVER_PROBE), *rows_of(KIDNEY_PROBE, light), *rows_of(BALL_CLAMPED), *rows_of(BALL_SQUEEZE)]
    results = publish(tmp_path, rows)
    assert body(advise(like(LIVER_PROBE, organ=BALL_CLAMPED.organ), results=results, timing=False)) == GRADED
    squeezed = like(BALL_CLAMPED, organ=KIDNEY_PROBE.organ)
    assert advise(squeezed, results=results, timing=False).alike == ("ball_clamped",)


def test_a_scene_whose_motion_matters_gets_no_results_of_slow_ones(results):
    (plane,) = LIVER_PRESS.obstacles
    fast = replace(plane, path=replace(plane.path, times=(0.0, 0.1)))
    with pytest.raises(StudyError, match=r"no results apply .* .solid, press.* moves at .* mm/s.*run FILE.py"):
        advise(like(LIVER_PRESS, organ=KIDNEY_PROBE.organ, obstacles=(fast,)), results=results, timing=False)


def test_a_scene_that_refuses_masses_by_stiffness_is_not_advised_them(tmp_path):
    lumped = replace(GRADED, mass="lumped")
    results = publish(tmp_path, rows_of(LIVER_PRESS, LADDER | {lumped: (-1.3, 0.8, 0.9)}))
    (plane,) = LIVER_PRESS.obstacles
    fast = replace(plane, path=replace(plane.path, times=(0.0, 0.1)))
    advice = advise(replace(LIVER_PRESS, name="fast", obstacles=(fast,)), results=results, timing=False)
    assert body(advice) == lumped


def test_a_kind_that_was_never_measured_is_not_guessed(results):
    with pytest.raises(StudyError, match=r"no results apply to scene 'ball_ringing': .* \(solid, motion\)"):
        advise("ball_ringing", results=results)
    thin = replace(LIVER_PRESS, name="thin", obstacles=(Probe((0.0, 0.0, 0.3)),))
    with pytest.raises(StudyError, match="solid, thin probe"):
        advise(thin, results=results)


@pytest.mark.parametrize("scene", [BALL_CLAMPED, BLADDER_FILL])
def test_where_nothing_is_stored_the_command_that_measures_is_named(results, scene):
    with pytest.raises(StudyError, match=r"no results of the study 'accuracy' for .*organbench run accuracy"):
        advise(scene, results=results)


@pytest.mark.parametrize("missing", ["recipe", "dt [ms]", "status"])
def test_a_table_that_names_no_recipes_is_one_sentence(tmp_path, missing):
    rows = [{k: v for k, v in each.items() if k != missing} for each in rows_of(LIVER_PRESS)]
    with pytest.raises(StudyError, match=r"accuracy\.csv cannot be read"):
        advise(LIVER_PRESS, results=publish(tmp_path, rows))


@pytest.mark.parametrize("bound", [-0.1, 0.0, NAN, float("inf"), "3%"])
@pytest.mark.parametrize("name", ["force", "displacement", "budget"])
def test_a_bound_that_is_none_is_one_sentence(results, name, bound):
    with pytest.raises(StudyError, match=f"{name} is .*; give a positive number"):
        advise(LIVER_PRESS, **{name: bound}, results=results)


def test_an_unknown_scene_is_answered_with_the_nearest(results):
    with pytest.raises(StudyError, match="did you mean 'liver_press'"):
        advise("liver_pres", results=results)


def test_nothing_is_recommended_that_does_not_meet_the_usual_wish(tmp_path):
    results = publish(tmp_path, rows_of(LIVER_PRESS, {ONE: LADDER[ONE]}))
    with pytest.raises(StudyError, match="no recipe is recommended for scene 'liver_press': no body meets"):
        recommended(LIVER_PRESS, results)
    coarse = publish(tmp_path, rows_of(LIVER_PRESS, **{"mean_error floor [%]": 1.5}))
    with pytest.raises(StudyError, match="the reference is not accurate enough to decide"):
        recommended(LIVER_PRESS, coarse)


def test_it_is_offered_where_users_import():
    assert studies.advise is advise and studies.recommended is recommended
    assert isinstance(EVEN, BodyRecipe)
