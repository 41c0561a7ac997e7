"""A sweep computes what is missing or stale, once; finished results stay, whatever happens to the others."""

from dataclasses import replace
from functools import partial

import h5py
import pytest

from studies.base.errors import StudyError
from studies.metrics.table import frame_of, metric, study_table
from studies.metrics.timing import cases as timed
from studies.metrics.timing.cases import timing_file
from studies.runs.current import case_path
from studies.runs.recipes import ADAPTIVE, QuadraticBody, TetrahedralBody
from studies.scene.scene import ReferencePlan
from studies.store.entry import Entry
from studies.store.ledger import Ledger
from studies.store.record import Status, read_record, write_record
from studies.sweep.job import CaseJob, jobs_of
from studies.sweep.load import References, load_runs, table_rows
from studies.sweep.local import Local
from studies.sweep.run_studies import run_studies
from studies.sweep.standings import failed, standings, warnings_of
from tests.studies.octant import SCENE
from tests.studies.tiny import Silent, content, diverging_case, tiny_case, tiny_study


def counts(root, study):
    statuses = [standing.status for standing in standings(Ledger(root), study)]
    return {status: statuses.count(status) for status in statuses}


def test_everything_once(finished_sweep):
    study = tiny_study()
    assert counts(finished_sweep, study) == {"ok": 2, "diverged": 1}
    runs, remarks = load_runs(finished_sweep, study)
    assert remarks == []
    assert [run.record.key for run in runs] == [case.key for case in study.cases]
    assert [run.timing is not None for run in runs] == [True, True, False]


def test_a_second_sweep_does_nothing_and_one_new_case_is_one_piece(results):
    before = content(results / "tiny")
    study, watched = tiny_study(), Silent()
    assert (run_studies(results, [study], 1, watched), watched.begun) == (0, [])
    assert content(results / "tiny") == before
    more = replace(study, cases=(*study.cases, tiny_case(dt_fraction=0.4)))
    assert run_studies(results, [more], 1, watched) == 1
    assert watched.begun == [("physics", 1)]
    assert watched.done == [("physics", tiny_case(dt_fraction=0.4).name)]
    assert before.items() <= content(results / "tiny").items()


def age(root, case):
    """Makes the record of a case one of older code."""
    path = case_path(root, "tiny", case)
    write_record(path, replace(read_record(path), fingerprint="0" * 64))


@pytest.mark.parametrize("number", [False, True], ids=["cut off", "another number"])
def test_a_damaged_file_is_stale_and_runs_again(results, number):
    study = tiny_study()
    path = case_path(results, "tiny", diverging_case())
    if number:
        with h5py.File(path, "r+") as file:
            file["mass"][0] *= 1.5
    else:
        path.write_bytes(path.read_bytes()[:1000])
    assert [s.message for s in standings(Ledger(results), study) if s.status == "stale"] == ["its file is damaged"]
    runs, remarks = load_runs(results, study)
    assert len(runs) == 2
    assert len(remarks) == 1
    assert path.name in remarks[0] and ("has no checksum" if number else "is cut off or damaged") in remarks[0]
    # The two other cases have the same body, which warns of its shape; the damaged one has none.
    (warning,) = warnings_of(Ledger(results), study)
    assert warning.startswith("tetrahedral, 60: ") and "volume -9.7 %" in warning
    assert not failed(Ledger(results), CaseJob(results, "tiny", diverging_case()))
    assert run_studies(results, [study], 1, Silent()) == 1
    assert load_runs(results, study)[1] == []


def test_warnings_of_the_best_body_come_first_and_the_worst_of_equals(tmp_path):
    texts = {
        TetrahedralBody(300): "volume -2.5 %",
        TetrahedralBody(60): "volume -9.7 %, up to 0.5 %",
        QuadraticBody(594, graded=ADAPTIVE): "11.4 mm of the scan is missing",
        QuadraticBody(594): "volume -0.2 %",
    }

    class Told(Ledger):
        def entry(self, job):
            return Entry("a.h5", (), warnings=texts[job.work.body])

    study = tiny_study(cases=tuple(tiny_case(body=body) for body in texts))
    assert [line.split(": ")[0] for line in warnings_of(Told(tmp_path), study)] == [
        "adaptive quadratic, 594",
        "quadratic, 594",
        "tetrahedral, 60",
        "tetrahedral, 300",
    ]


def test_only_what_the_filter_lets_through(results):
    study = tiny_study()
    age(results, tiny_case())
    path = case_path(results, "tiny", diverging_case())
    write_record(path, replace(read_record(path), status=Status.TIMED_OUT))
    timed.timing_file(results, "tiny", tiny_case(timed=True)).unlink()
    watched = Silent()
    assert run_studies(results, [study], 1, watched, selection=partial(failed, Ledger(results))) == 1
    assert watched.done == [("physics", diverging_case().name)]
    assert counts(results, study) == {"ok": 1, "stale": 1, "diverged": 1}


def test_references_are_shared_and_come_first(tmp_path):
    larger = replace(SCENE, name="larger", reference=ReferencePlan("octant", (0.5, 0.25)))
    cases = tiny_case(scene=SCENE), tiny_case(scene=larger)
    one, two = (tiny_study(name=name, cases=cases) for name in ("one", "two"))
    jobs = jobs_of(tmp_path, [one, two])
    assert [job.label for job in jobs[:2]] == ["reference larger", "reference ball_squeeze"]
    assert len(jobs) == 2 + 4  # a reference of each scene, shared; two cases of each study
    assert len({job.path for job in jobs}) == 6


def test_a_study_scene_by_scene_finishes_one_before_the_next_and_after_the_others(tmp_path):
    larger = replace(SCENE, name="larger", reference=ReferencePlan("octant", (0.5, 0.25)))
    study = tiny_study(cases=(tiny_case(scene=SCENE), tiny_case(scene=larger)))
    turns = replace(study, name="turns", scene_by_scene=True)
    reference, case, larger_reference, larger_case = jobs_of(tmp_path, [turns])
    assert [reference.label, larger_reference.label] == ["reference ball_squeeze", "reference larger"]
    assert [case.work.scene.name, larger_case.work.scene.name] == ["ball_squeeze", "larger"]
    together = [(job.study, job.label) for job in jobs_of(tmp_path, [turns, study])]
    assert [label for _, label in together[:2]] == ["reference larger", "reference ball_squeeze"]
    assert [name for name, _ in together[2:]] == [study.name, study.name, "turns", "turns"]


def test_a_folder_that_cannot_be_written_to_is_refused_before_anything_runs(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setattr(Local, "map", lambda *_: pytest.fail("nothing may run"))
    with pytest.raises(StudyError, match="choose a folder that can be written to"):
        run_studies(tmp_path / "file", [tiny_study()], 1, Silent())


STUDY = tiny_study(columns=("volume_worst", "step_time", "min_j"))


def table_of(root):
    rows, remarks = table_rows(References(Ledger(root)), STUDY, [metric(name) for name in STUDY.columns])
    return frame_of(rows), remarks


def test_the_rows_of_a_table_are_those_of_the_runs_and_what_is_missing_is_a_remark(results):
    table, remarks = table_of(results)
    assert table.equals(study_table(load_runs(results, STUDY)[0], STUDY.columns)) and remarks == []
    timing_file(results, "tiny", STUDY.cases[0]).unlink()
    assert table_of(results)[0]["step_time [µs]"].isna().tolist() == [True, False, True]
    case_path(results, "tiny", STUDY.cases[1]).unlink()
    table, remarks = table_of(results)
    assert len(table) == 2 and remarks == [f"case {STUDY.cases[1].name} has not run"]
