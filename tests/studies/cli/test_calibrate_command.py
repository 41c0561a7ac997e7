"""`organbench calibrate` shows both sides of a fit in 80 columns, and refuses in one sentence."""

from dataclasses import replace

import pytest

from studies.tools.calibrate.stored import write_calibration
from studies.tools.calibrate.verdict import Verdict
from studies.tools.calibrate.words import lines_of
from tests.studies.tools.calibrate.made_up_errors import made_up


def test_a_stored_calibration_is_printed_again(organbench, tmp_path):
    code, out, err = organbench("calibrate", write_calibration(tmp_path, made_up()))
    assert (code, err) == (0, "") and out.splitlines() == lines_of(made_up())


def test_the_table_shows_both_sides():
    lines = lines_of(made_up(Verdict.MEMORISES))
    assert max(map(len, lines)) <= 80
    cells = {line.split()[0]: line.split()[1:] for line in lines if line.startswith("  liver_")}
    assert cells == {
        "liver_press": ["fitted", "−25.8", "+0.0", "1.7", "3.8", "3.8", "1.4"],
        "liver_probe": ["judged", "−33.2", "lost", "1.0", "–", "–", "–"],
    }
    assert "  fitted on liver_press: stiffness 2.655 (was 1)" in lines
    assert "    verdict: force memorises; a remark" in lines
    text = " ".join(line.strip() for line in lines)
    assert text.endswith("stored recipe, fitted on liver_press: stiffness 1.626 (was 1), inner weight 0.4388 (was 0.5)")


@pytest.mark.parametrize(
    ("verdicts", "message"),
    [
        ((Verdict.HOLDS, Verdict.HOLDS), "force: the fit generalises:"),
        ((Verdict.HOLDS, Verdict.MEMORISES), "force: the fit overfits:"),
        ((Verdict.UNRESOLVED, Verdict.HOLDS), "force: the fit generalises:"),
        ((Verdict.UNRESOLVED, Verdict.UNRESOLVED), "force: not resolvable:"),
    ],
)
def test_the_worst_trial_of_a_quantity_has_its_sentence(verdicts, message):
    (trial,) = made_up().trials
    lines = lines_of(made_up(trials=tuple(replace(trial, force=verdict) for verdict in verdicts)))
    assert sum(line.startswith("force: ") for line in lines) == sum(message in line for line in lines) == 1
    assert not any(line.startswith("displacement: ") for line in lines)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("livr",), "unknown organ 'livr'; did you mean 'liver'"),
        (("liver", "--body", "surfac"), "unknown body 'surfac'; did you mean 'surface'"),
        (("none.json",), "there is no calibration none.json"),
    ],
)
def test_bad_input_is_one_sentence(refused, tmp_path, words, message):
    assert message in refused("calibrate", *words, "--results", tmp_path)


def test_an_organ_without_a_reference_is_one_sentence(refused, tmp_path, monkeypatch):
    monkeypatch.setattr("studies.tools.calibrate.folds.judged_at_rest", lambda: ())
    assert "organ 'kidney' has no scene with a reference" in refused("calibrate", "kidney", "--results", tmp_path)


def test_a_damaged_or_foreign_file_is_one_sentence(refused, tmp_path):
    path = write_calibration(tmp_path, made_up())
    path.write_text(path.read_text().replace("1.626", "1.627"))
    assert "was changed after it was written" in refused("calibrate", path)
    path.write_text('{"name": "something else"}')
    assert "is JSON, but not a calibration" in refused("calibrate", path)


STUDY = """
from studies import Case, LIVER_PROBE, Study, calibrated

STUDY = Study("mine", "Does it hold?", (Case(LIVER_PROBE, calibrated({path!r})),), (), ("force_end",))
"""


def test_a_study_file_runs_a_fitted_recipe(organbench, refused, tmp_path):
    path, file = write_calibration(tmp_path, made_up()), tmp_path / "mine.py"
    file.write_text(STUDY.format(path=str(path)))
    code, out, _ = organbench("run", file, "--dry-run", "--results", tmp_path)
    assert code == 0 and "1 case (missing)" in out
    path.write_text("{")
    assert "is damaged or not a calibration" in refused("run", file, "--dry-run", "--results", tmp_path)
