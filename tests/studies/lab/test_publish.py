"""What is published is made by a command, copied by a program, and checked by drawing rows."""

import subprocess
from pathlib import Path

import pandas as pd
import pytest

from studies import STUDIES, StudyError, load_runs, study_table
from studies.lab.publish import __main__ as publishing
from studies.lab.publish import draw
from studies.lab.refusal import refusal
from tests.studies.tiny import tiny_study

PUBLISHED = Path(__file__).parents[3] / publishing.PUBLISHED


def test_everything_published_is_made_by_a_study_or_a_command():
    names = {study.name for study in STUDIES} | set(publishing.EXTRAS)
    assert [path.name for path in PUBLISHED.iterdir() if path.name not in names] == []


def test_git_sees_what_is_published_and_nothing_else_below_results():
    own = [
        "summary.md",
        "machine.json",
        "reference/uncertainty.csv",
        "cache/meshes/a.npz",
        "accuracy/a.h5",
        "report.html",
    ]
    paths = [f"{folder}/{name}" for folder in ("results", "results/published") for name in own]
    done = subprocess.run(
        ["git", "check-ignore", *paths], cwd=PUBLISHED.parents[1], capture_output=True, text=True, check=False
    )
    if done.returncode == 128:
        pytest.skip("not a clone")
    assert set(done.stdout.split()) == set(paths[: len(own)])


@pytest.mark.lab
def test_tables_are_copied_and_rows_drawn_from_them_are_what_a_run_gives(results, tmp_path, monkeypatch, capsys):
    study = tiny_study(name="volume_loss")
    (results / "tiny").rename(results / "volume_loss")
    monkeypatch.setattr(publishing, "_organbench", lambda *words: None)  # all is current and drawn
    monkeypatch.setattr(draw, "STUDIES", (study,))
    table = study_table(load_runs(results, study)[0], study.columns)
    table.to_csv(results / "volume_loss" / "volume_loss.csv", index=False, float_format="%.6g")
    target = tmp_path / "published"
    (target / "volume_loss").mkdir(parents=True)
    (target / "volume_loss" / "older.png").write_text("old")
    publishing.publish(results, ["volume_loss"], target)
    assert [file.name for file in (target / "volume_loss").iterdir()] == ["volume_loss.csv"]
    with pytest.raises(StudyError, match="nothing makes 'laws2'"):
        publishing.publish(results, ["laws2"], target)
    words = ["--seed", "3", "--rows", "2", "--published", str(target)]
    assert draw.main(words) == 0 and "2 of 2 rows are what is published" in capsys.readouterr().out
    path = target / "volume_loss" / "volume_loss.csv"
    rows = pd.read_csv(path)
    rows["volume_worst [%]"] *= 1.01
    rows.to_csv(path, index=False)
    assert draw.main(words) == 1 and "DIFFERS" in capsys.readouterr().out


def test_random_organs_are_drawn_that_are_published():
    *catalogue, people = draw.studies_of(PUBLISHED)
    rows = pd.read_csv(PUBLISHED / "population" / "population.csv")
    assert catalogue == list(STUDIES) and len(people.cases) >= len(rows) > 0
    assert {case.scene.name for case in people.cases} == set(rows["scene"])


def test_a_time_is_no_difference_and_a_number_is_one():
    row = {"status": "ok", "dt/dt_c": 0.5, "cut_ms [ms]": 0.31, "step_time [µs]": 20.0, "force_end [%]": 1.5}
    later = row | {"cut_ms [ms]": 0.36, "step_time [µs]": 25.0}
    assert draw.difference(later, row)["verdict"] == "equal"
    assert draw.difference(later | {"force_end [%]": 1.51}, row)["verdict"] == draw.DIFFERS


def test_a_refused_command_of_the_lab_ends_with_its_sentence_and_two(capsys):
    with pytest.raises(SystemExit) as stop, refusal("publish"):
        raise StudyError("nothing makes 'x'")
    assert (stop.value.code, capsys.readouterr().err) == (2, "publish: nothing makes 'x'\n")
