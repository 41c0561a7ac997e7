"""`organbench advise` prints errors with their uncertainties, the cost, and the command that repeats the run."""

import shutil
from pathlib import Path

import pytest

from studies.catalog.accuracy import ACCURACY
from studies.runs.case import Case
from studies.runs.recipes import QuadraticBody
from studies.scene.library import KIDNEY_PROBE, LIVER_PRESS, LIVER_PROBE
from studies.tools.advise import campaign
from tests.studies.tools.advise.made_up_campaign import GRADED, LADDER, publish, row, rows_of

STUDY = """
from dataclasses import replace
from massspring import ImplicitVolume
from studies import LIVER_PROBE, Case, Study, TetrahedralBody

MINE = replace(LIVER_PROBE, name="mine", duration=9.0, reference=None)
STUDY = Study("mine", "Does it run?", tuple(Case(s, TetrahedralBody(), ImplicitVolume()) for s in [MINE]), (), ())
"""


@pytest.fixture
def advise(organbench, tmp_path):
    """Asks about a scene of a published campaign: the answer as one text."""
    publish(tmp_path, [*rows_of(LIVER_PRESS), *rows_of(LIVER_PROBE), *rows_of(KIDNEY_PROBE)])

    def ask(*words, meets=True) -> str:
        code, out, err = organbench("advise", *words, "--results", tmp_path)
        assert (code, err) == (0 if meets else 1, "")
        return out

    return ask


def test_an_answer_holds_recipe_errors_cost_source_and_commands(advise, tmp_path):
    out = advise("liver_press")
    assert "liver_press: force within 3 %, displacement within 1 % (default target" in out
    assert "adaptive quadratic, heavy masses, 994 surface nodes, dt = 0.8 dt_c, 2 ms" in out
    assert "−1.2 ± 0.5 %" in out and "0.8 ± 0.1 %" in out
    assert "0.5 ms per 1 ms of simulated time, 2 times real time, on this machine" in out
    assert str(tmp_path / "published" / "accuracy" / "accuracy.csv") in out.replace("\n", "")
    (name,) = (line.split("--case ")[1] for line in out.splitlines() if "--case" in line)
    timed = Case(LIVER_PRESS, GRADED, dt_fraction=0.8, timed=True)
    assert timed in [case.replaced(recorded=()) for case in ACCURACY.cases if case.name == name]
    (python,) = (line.split("in Python")[1] for line in out.splitlines() if "in Python" in line)
    made = eval(python, {"Case": Case, "QuadraticBody": QuadraticBody, "LIVER_PRESS": LIVER_PRESS})
    assert made == Case(LIVER_PRESS, GRADED, dt_fraction=0.8)


def test_a_miss_says_by_how_much(advise):
    out = advise("liver_press", "--budget", "250us", meets=False)
    assert "at most 0.25 ms of computing per 1 ms of simulated time" in out
    assert "no body meets it; the closest candidate is (displacement 1.4 times too large):" in out


def test_a_wish_finer_than_the_reference_is_undecided(advise):
    out = advise("liver_press", "--force", "0.4%", meets=False)
    assert "undecided: the reference is only known to ±0.5 % of the force" in out


def test_a_wish_within_the_uncertainty_has_a_remark(advise):
    assert "reaches beyond the target (displacement)" in advise("liver_press", "--displacement", "0.85 %")
    assert "reaches beyond" not in advise("liver_press")


def test_a_scene_of_the_user_gets_the_worst_of_its_kind(advise, tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(STUDY)
    out = advise(file, "--no-timing")
    assert "no run of this scene is stored: errors, shape and step are the worst of liver_probe and kidney_probe" in out
    assert "on another machine" in out and "in Python     Case(scene, QuadraticBody(nodes" in out


def test_times_of_another_machine_are_called_so(organbench, tmp_path):
    publish(tmp_path, rows_of(LIVER_PRESS), machine="0badcafe")
    _, out, _ = organbench("advise", "liver_press", "--no-timing", "--results", tmp_path)
    assert "2 times real time, on another machine" in out


def test_a_budget_without_a_time_is_not_met(organbench, tmp_path):
    rows = [row(LIVER_PRESS, b, n) | {"real_time [s/s]": float("nan")} for b, n in LADDER.items()]
    publish(tmp_path, rows)
    _, out, _ = organbench("advise", "liver_press", "--budget", "1ms", "--no-timing", "--results", tmp_path)
    assert "its computing time is not known on this machine" in out and "leave out --no-timing" in out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("liver_pres",), "unknown scene 'liver_pres'; did you mean 'liver_press'"),
        (("liver_press", "--force", "much"), "force 'much' is not a tolerance"),
        (("liver_press", "--displacement", "-1%"), "displacement '-1%' is not a tolerance"),
        (("liver_press", "--budget", "1"), "budget '1' is not a time"),
        (("liver_press",), "no results of the study 'accuracy'"),
        (("ball_ringing",), "no results apply to scene 'ball_ringing'"),
        (("ball_incised",), "no results apply to scene 'ball_incised', which cuts its organ"),
        (("nothing.py",), "there is no file nothing.py"),
    ],
)
def test_bad_input_is_one_sentence(refused, no_tables, tmp_path, words, message):
    assert message in refused("advise", *words, "--results", tmp_path)


@pytest.mark.parametrize("package", [False, True], ids=["in a checkout", "in a wheel"])
def test_in_an_empty_folder_the_tables_of_the_program_count(organbench, tmp_path, monkeypatch, package):
    if package:
        home = campaign.PACKAGE.parent / "results" / "published"
        shutil.copytree(home / "accuracy", tmp_path / "package" / "published" / "accuracy")
        monkeypatch.setattr(campaign, "PACKAGE", tmp_path / "package")
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    code, out, err = organbench("advise", "liver_press", "--no-timing")
    assert (code, err) == (0, "") and "nodes=994" in out and "published/accuracy/accuracy.csv" in out
    # A table of one's own comes first.
    publish(Path("results"), rows_of(LIVER_PRESS))
    assert "nodes=994" in organbench("advise", "liver_press", "--no-timing")[1]
