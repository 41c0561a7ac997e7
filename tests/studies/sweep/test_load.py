"""The table of a study is that of its stored runs."""

from studies.metrics.table import frame_of, metric, study_table
from studies.metrics.timing.cases import timing_file
from studies.runs.current import case_path
from studies.store.ledger import Ledger
from studies.sweep.load import References, load_runs, table_rows
from tests.studies.tiny import tiny_study

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
