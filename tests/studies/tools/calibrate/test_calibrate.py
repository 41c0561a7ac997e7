"""A calibration from scene to file: on a coarse reference of the squeezed ball, and one less deep."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.runs.case import BodyRecipe
from studies.scene.library import BALL_SQUEEZE, Organ, ReferencePlan
from studies.store.ledger import Ledger
from studies.tools.calibrate.calibrate import calibrate, calibration, starting_recipe
from studies.tools.calibrate.folds import Fold
from studies.tools.calibrate.measured import Measurements
from studies.tools.calibrate.stored import STUDY, calibrated, calibration_path, read_calibration
from studies.tools.calibrate.verdict import Verdict
from tests.studies.octant import LEVELS, SCENE
from tests.studies.tiny import NODES, Silent
from tests.studies.tools.calibrate.made_up_errors import judged

DEEP = replace(SCENE, frames=80)
PLAN = ReferencePlan("octant", LEVELS[:2], variants=())
SHALLOW = replace(DEEP, name="shallow", checkpoints=(1.0,), duration=1.2, reference=PLAN)
FOLDS = (Fold((DEEP,), (SHALLOW,)), Fold((SHALLOW,), (DEEP,)))
BODY = BodyRecipe(nodes=NODES)


@pytest.fixture(scope="module")
def made(solved, tmp_path_factory):
    """Results folder of a calibration whose second scene has no reference yet, the calibration, and its progress."""
    folder = shutil.copytree(solved, tmp_path_factory.mktemp("calibration") / "results")
    progress = Silent()
    return folder, calibrate("ball", BODY, folder, progress=progress, folds=FOLDS), progress


@pytest.mark.campaign
def test_the_factor_is_the_one_that_the_first_error_asks_for(made):
    """Forces of a slow press grow in proportion to the springs: F_ref/F = 1/(1 + e/100). Drag does not grow with them,
    up to 2 % of the force."""
    _, outcome, _ = made
    assert [trial.fitted for trial in outcome.trials] == [(DEEP.name,), (SHALLOW.name,)]
    for trial in outcome.trials:
        own = next(errors for errors in trial.errors if errors.fitted)
        assert own.displacement is None and own.force.before < -20.0
        assert trial.parameters["stiffness"] == pytest.approx(1 / (1 + own.force.before / 100), rel=0.02)
        assert abs(own.force.after) < 1.0
    assert outcome.parameters["stiffness"] == outcome.recipe.stiffness


@pytest.mark.campaign
def test_the_final_recipe_lies_between_those_of_the_trials(made):
    _, outcome, _ = made
    low, high = sorted(trial.parameters["stiffness"] for trial in outcome.trials)
    assert low <= outcome.recipe.stiffness <= high and outcome.fitted == (DEEP.name, SHALLOW.name)


@pytest.mark.campaign
def test_judged_errors_are_those_of_the_fitted_body(made):
    folder, outcome, _ = made
    runs = Measurements(Ledger(folder), (DEEP, SHALLOW))
    for trial, scene in zip(outcome.trials, (SHALLOW, DEEP), strict=True):
        (judged,) = (errors for errors in trial.errors if not errors.fitted)
        body = replace(BODY, stiffness=trial.parameters["stiffness"])
        assert judged.scene == scene.name and judged.force.after == runs.errors(scene, body).force.value
    assert runs.made == 0
    assert {trial.displacement for trial in outcome.trials} == {None}


@pytest.mark.campaign
def test_it_is_stored_and_read_back(made):
    folder, outcome, _ = made
    path = calibration_path(folder, outcome)
    assert path == folder / STUDY / f"ball-tetrahedral-{NODES}.json"
    assert read_calibration(path) == outcome and calibrated(path) == outcome.recipe


@pytest.mark.campaign
def test_progress_counts_every_solve_and_fit(made):
    _, _, progress = made
    assert dict(progress.begun) == {"physics": 3, "fitting": 3}  # a reference and two first runs
    assert len(progress.done) == 6


@pytest.mark.campaign
def test_an_interrupted_calibration_goes_on(made, tmp_path, monkeypatch):
    """What was run is not run again: after half of it is lost, the other half is made, to the same end."""
    folder, outcome, _ = made
    again = shutil.copytree(folder, tmp_path / "again")
    records = sorted((again / STUDY).glob("*.h5"))
    for record in records[::2]:
        record.unlink()
    calibration_path(again, outcome).unlink()
    assert calibrate("ball", BODY, again, folds=FOLDS) == outcome
    assert {path.name for path in (again / STUDY).glob("*.h5")} == {path.name for path in records}

    def refuse(*_):
        raise AssertionError("a stored case was run again")

    monkeypatch.setattr("studies.sweep.job.CaseJob.run", refuse)
    assert calibrate("ball", BODY, again, folds=FOLDS) == outcome


@pytest.mark.campaign
def test_a_body_that_ends_badly_from_the_start_is_named(made):
    folder, _, _ = made
    runs = Measurements(Ledger(folder), (DEEP,))
    with pytest.raises(StudyError, match=r"ended as failed before the fit .*give another number of nodes"):
        runs.first_errors(DEEP, BodyRecipe(nodes=3))


def test_scenes_are_needed_on_both_sides(tmp_path):
    with pytest.raises(StudyError, match="scenes to fit and other scenes to test"):
        calibrate("ball", BODY, tmp_path, folds=())
    with pytest.raises(StudyError, match="has no reference for fitting"):
        calibrate("ball", BODY, tmp_path, folds=(Fold((DEEP,), (replace(BALL_SQUEEZE, reference=None),)),))
    with pytest.raises(StudyError, match="two scenes of a calibration are called 'ball_squeeze'"):
        calibrate("ball", BODY, tmp_path, folds=(Fold((DEEP,), (SHALLOW, replace(DEEP, damping=1.0))),))


def test_remarks_name_what_limits_a_trial(monkeypatch):
    """A liver judged on a ball: one error is compared, the search is cut at the end of its range, the body breaks."""
    liver = replace(SHALLOW, name="of_a_liver", organ=Organ("liver"))

    class Runs:
        def errors(self, scene, recipe):
            force = 100 * (recipe.stiffness / 1000 - 1)
            return None if scene.organ.shape == "ball" and recipe.stiffness > 2 else judged(scene, recipe, force)

        first_errors = errors

    monkeypatch.setattr("studies.tools.calibrate.fit.MOST", 3)
    body = BodyRecipe("surface", NODES)
    outcome = calibration("liver", body, (Fold((liver,), (DEEP,)),), Runs(), Silent())  # type: ignore[arg-type]
    (trial,) = outcome.trials
    assert [remark.split()[0] for remark in trial.remarks] == ["judged", "inner", "stiffness", "the", "the"]
    assert trial.remarks[0] == "judged on other organs (ball)"
    assert trial.remarks[-1] == "the fitted body failed in ball_squeeze"
    assert outcome.verdict is trial.force is Verdict.MEMORISES and trial.errors[1].force.after is None


def test_a_hollow_organ_starts_with_a_bent_axis():
    assert starting_recipe("stomach", "surface", 400) == BodyRecipe("surface", 400, axis="centre_line")
    assert starting_recipe("liver", "surface") == BodyRecipe("surface", 550)
    assert starting_recipe("stomach", "tetrahedral") == BodyRecipe(nodes=550)
    with pytest.raises(StudyError, match="unknown body for a calibration 'surfaces'; did you mean 'surface'"):
        starting_recipe("liver", "surfaces")


@pytest.mark.campaign
def test_errors_of_a_run_are_finite_or_not_compared(made):
    _, outcome, _ = made
    values = [errors.force for trial in outcome.trials for errors in trial.errors]
    assert np.isfinite([[v.before, v.after, v.uncertainty] for v in values]).all()
