"""What is published is made by a command, copied by a program, and checked by drawing rows."""

import subprocess
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from massspring import Free
from studies import STUDIES, StudyError, load_runs, study_table
from studies.lab.publish import __main__ as publishing
from studies.lab.publish import draw
from studies.lab.publish.kept_volume import kept_volumes, promised, worst_volume
from studies.lab.refusal import refusal
from studies.runs.current import case_path
from studies.store.record import read_record, write_record
from tests.studies.tiny import SQUEEZE, diverging_case, tiny_case, tiny_study

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


def test_the_promise_covers_the_default_step_from_rest_alone():
    assert promised(tiny_case())
    assert promised(tiny_case(dt_fraction=0.05))
    assert not any(map(promised, (tiny_case(method=Free()), tiny_case(dt_fraction=0.9), tiny_case(dt=1e-3))))


def test_the_table_is_read_off_the_stored_runs(results):
    study = tiny_study()
    table = kept_volumes(results, [study])
    (row,) = table.to_dict("records")
    path = case_path(results, "tiny", tiny_case(timed=True))
    record = read_record(path)
    assert row["worst |V/V0 - 1| [1]"] == worst_volume(record)
    assert (row["at most 1e-4"], row["volumes"], row["scene"]) == ("yes", 1, SQUEEZE.name)
    spoiled = record.fields["volume"].values.copy()
    spoiled[2] *= 1.0002
    fields = record.fields | {"volume": replace(record.fields["volume"], values=spoiled)}
    write_record(path, replace(record, fields=fields))
    assert kept_volumes(results, [study])["at most 1e-4"].tolist() == ["NO"]
    assert kept_volumes(results / "nowhere", [study]).empty
    assert kept_volumes(results, [tiny_study(cases=(diverging_case(),))]).empty


def test_a_refused_command_of_the_lab_ends_with_its_sentence_and_two(capsys):
    with pytest.raises(SystemExit) as stop, refusal("publish"):
        raise StudyError("nothing makes 'x'")
    assert (stop.value.code, capsys.readouterr().err) == (2, "publish: nothing makes 'x'\n")
