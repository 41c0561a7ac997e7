"""Charts, tables and the summary show what is stored, and name what is missing."""

import json
import os
import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from studies.catalog import Chart
from studies.catalog.volume_loss import VOLUME_LOSS
from studies.metrics.cells import UNRESOLVED_MARK
from studies.report.results import draw_charts, refresh, report
from studies.report.summary import results_of
from studies.runs.current import case_path
from studies.store.ledger import Ledger
from studies.store.machine import machine_id
from studies.store.record import Status
from studies.store.tables import write_table
from studies.sweep import load as sweep_load
from studies.sweep.load import load_runs
from tests.studies.tiny import tiny_case, tiny_study


def headline(runs) -> list[list[str]]:
    """Rows of the summary, cell by cell, without the two lines of its head."""
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in results_of(runs).splitlines()[2:]]


def test_charts_get_the_runs_and_their_path(finished_sweep, tmp_path):
    drawn = []
    study = tiny_study(charts=(Chart("one.png", lambda runs, path: drawn.append((len(runs), path))),))
    paths = draw_charts(tmp_path, study, load_runs(finished_sweep, study)[0])
    assert paths == [tmp_path / "tiny" / "one.png"] and drawn == [(3, paths[0])] and paths[0].parent.is_dir()


def test_a_table_is_read_back_as_it_was(tmp_path):
    table = pd.DataFrame({"status": ["ok", "diverged"], "force [%]": [1.0 / 3.0, np.nan], "nodes": [150, 2200]})
    again = pd.read_csv(write_table(tmp_path / "new" / "t.csv", table))
    pd.testing.assert_frame_equal(again, table, rtol=1e-6)


def test_report_writes_everything_and_names_what_is_missing(results):
    more = tiny_case(dt_fraction=0.4)
    study = tiny_study(cases=(*tiny_study().cases, more))
    written, remarks = report(Ledger(results), [study])
    assert written == [results / name for name in ("tiny/tiny.csv", "report.html")]
    assert remarks == [f"tiny: case {more.name} has not run"] and len(pd.read_csv(written[0])) == 3
    assert json.loads((results / "machine.json").read_text())["id"] == machine_id()


def test_summary_shows_numbers_or_a_dash(finished_sweep):
    runs, _ = load_runs(finished_sweep, tiny_study())
    kept, free, lost = headline(runs)
    assert kept[:3] == ["tiny_squeeze", "tetrahedral", "implicit_volume"]
    assert float(kept[3]) < float(free[3])
    assert kept[4] == "–"  # no reference, no force error
    assert lost[3:] == ["–"] * 8


def test_summary_marks_what_the_reference_does_not_know_well_enough(finished_sweep):
    runs, _ = load_runs(finished_sweep, tiny_study())
    assert UNRESOLVED_MARK not in results_of(runs)
    uncertainty = dict.fromkeys(("force_end", "silhouette", "force", "volume", "surface_mean"), 0.02)
    truth = SimpleNamespace(
        source="made up",
        shape_error=float("nan"),
        total_uncertainty=uncertainty,
        force=np.array([1.0]),
        displacement=lambda x: 0 * x,
    )
    assert f"± 2 {UNRESOLVED_MARK} |" in results_of([replace(runs[0], reference=truth)]).replace("2.0", "2")


def test_fine_steps_are_no_headline_and_a_case_that_failed_is_a_dash(finished_sweep):
    runs, _ = load_runs(finished_sweep, tiny_study())
    record = runs[0].record
    fine = replace(record, attributes=record.attributes | {"dt": 0.05 * record.attributes["dt_limit"]})
    assert headline([replace(runs[0], record=fine), runs[1]]) == headline([runs[1]])
    failed = replace(record, attributes={}, fields={}, status=Status.FAILED)
    assert headline([replace(runs[0], record=failed)])[0][3:] == ["–"] * 8
    folded = replace(record, status=Status.FOLDED)
    assert headline([replace(runs[0], record=folded)])[0][2] == headline([runs[0]])[0][2] + " (*folded*)"
    assert "make study" in results_of([])


def test_studies_that_were_not_run_are_one_line_and_their_references_not_read(results, monkeypatch):
    read = []
    monkeypatch.setattr(sweep_load, "reference_for", lambda root, scene: read.append(scene.name))
    _, remarks = report(Ledger(results), [tiny_study(), VOLUME_LOSS, replace(tiny_study(), name="third")])
    assert [remark for remark in remarks if "no results here" in remark] == [
        "skipped (no results here; existing charts kept): volume_loss, third. Run `make study-NAME` first"
    ]
    assert set(read) == {scene.name for scene in tiny_study().scenes}


def test_what_is_shown_already_is_not_drawn_again(results):
    """The skip of the second `make study`: nothing is drawn until a result, or a picture, is no longer the same."""
    drawn = []

    def draw(runs, path):
        drawn.append(len(runs))
        path.write_bytes(b"picture")

    study = tiny_study(charts=(Chart("one.png", draw),))
    paths, _ = refresh(Ledger(results), study)
    assert [path.name for path in paths] == ["one.png", f"{study.name}.csv"] and len(drawn) == 1
    before = [path.read_bytes() for path in paths]
    assert refresh(Ledger(results), study)[0] == paths and len(drawn) == 1
    paths[0].unlink()
    refresh(Ledger(results), study)
    assert len(drawn) == 2 and [path.read_bytes() for path in paths] == before
    os.utime(case_path(results, study.name, study.cases[0]), ns=(1, 1))
    refresh(Ledger(results), study)
    assert len(drawn) == 3


def test_the_headline_study_writes_the_summary_too(results):
    paths, _ = refresh(Ledger(results), replace(tiny_study(), name="volume_loss"))
    assert paths[-1] == results / "summary.md" and paths[-1].is_file()


@pytest.mark.parametrize("text", ['{"inp', "[]", '{"inputs": 1, "remarks": []}', "\udcff"])
def test_a_stamp_that_is_damaged_is_drawn_again(results, text):
    study = tiny_study(charts=(Chart("one.png", lambda runs, path: path.write_bytes(b"picture")),))
    refresh(Ledger(results), study)
    stamp = results / "cache" / f"{study.name}.drawn.json"
    whole = stamp.read_bytes()
    stamp.write_bytes(text.encode(errors="surrogateescape"))
    refresh(Ledger(results), study)
    assert stamp.read_bytes() == whole


def test_studies_of_one_scene_share_its_reference(results, monkeypatch):
    loaded, load = [], sweep_load.reference_for
    monkeypatch.setattr(sweep_load, "reference_for", lambda root, scene: loaded.append(scene.name) or load(root, scene))
    shutil.copytree(results / "tiny", results / "twin")
    report(Ledger(results), [tiny_study(), tiny_study(name="twin")])
    assert loaded == [scene.name for scene in tiny_study().scenes]
