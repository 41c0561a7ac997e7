"""What moved between two results folders: verdicts, rows that belong together, folders that cannot be compared."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from studies.base.errors import StudyError
from studies.cli.commands.compare import rows_of
from studies.metrics.change import ROUND_OFF, Verdict, verdict_of
from studies.metrics.compare_folders import compare
from studies.metrics.table import study_table
from studies.store.ledger import Ledger
from studies.store.links import link_study
from studies.store.paths import record_files
from studies.store.record import read_record, write_record
from studies.store.tables import write_table
from studies.sweep.load import load_runs
from tests.studies.tiny import tiny_study

PUBLISHED = Path(__file__).parents[3] / "results" / "published"
NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("old", "new", "floor", "same", "verdict"),
    [
        (2.0, 2.0, 0.1, True, Verdict.SAME_BITS),
        (2.0, 2.0, 0.1, False, Verdict.ROUND_OFF),
        (2.0, 2.0 * (1 + 0.5 * ROUND_OFF), NAN, False, Verdict.ROUND_OFF),
        (2.0, 2.05, 0.1, False, Verdict.WITHIN_FLOOR),
        (2.0, 1.85, 0.1, False, Verdict.MOVED),
        (2.0, 2.05, 0.1, True, Verdict.WITHIN_FLOOR),
        (2.0, 2.05, NAN, False, Verdict.NOT_RESOLVABLE),
        (NAN, 2.0, 0.1, False, Verdict.NOT_RESOLVABLE),
        (2.0, NAN, NAN, False, Verdict.MOVED),
        (2.0, INF, INF, False, Verdict.MOVED),
        (-INF, INF, 0.1, False, Verdict.MOVED),
        (INF, INF, NAN, True, Verdict.SAME_BITS),
        (0.0, 0.0, NAN, False, Verdict.ROUND_OFF),
    ],
)
def test_the_verdict_on_a_change_follows_from_its_uncertainty(old, new, floor, same, verdict):
    assert verdict_of(old, new, floor, same) == verdict


def rows(**changes):
    """Two cases of a study."""
    first = {"scene": "ball", "body": "surface", "method": "free", "status": "ok", "recipe": "{}"}
    first |= {"dt [ms]": 1.0, "force_end [%]": -30.0, "force_end floor [%]": 0.5, "min_j [1]": 0.5, "doubtful": ""}
    return [first | changes, first | {"recipe": '{"dt_fraction": 0.1}'}]


def folder(path, table, study="made_up"):
    (path / study).mkdir(parents=True)
    write_table(path / study / f"{study}.csv", pd.DataFrame(table))
    return path


def verdicts_of(comparison, metric="force_end"):
    return [change.verdict for change in comparison.changes if change.metric == metric]


def test_each_case_is_compared_with_itself(tmp_path):
    old, new = folder(tmp_path / "old", rows()), folder(tmp_path / "new", rows(**{"force_end [%]": -31.0})[::-1])
    comparison = compare(old, new)
    assert sorted(verdicts_of(comparison)) == sorted([Verdict.MOVED, Verdict.ROUND_OFF])
    (moved,) = comparison.moved
    assert (moved.case.recipe, moved.old, moved.new, moved.floor, moved.unit) == ("{}", -30.0, -31.0, 0.5, "%")
    assert {change.metric for change in comparison.changes} == {"force_end", "min_j"}
    assert sum(comparison.counts(times=False).values()) == len(comparison.changes) == 4


def test_the_larger_floor_of_both_counts(tmp_path):
    old = folder(tmp_path / "old", rows())
    new = folder(tmp_path / "new", rows(**{"force_end [%]": -31.0, "force_end floor [%]": 2.0}))
    assert compare(old, new).moved == []


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (None, "holds no results"),
        (rows()[:1], "lacks 1 rows"),
        ([{name: value for name, value in row.items() if name != "min_j [1]"} for row in rows()], "min_j"),
        (rows(), None),
    ],
)
def test_what_a_table_lost_is_found(tmp_path, table, said):
    for path in (old := tmp_path / "old", new := tmp_path / "new"):
        folder(path, rows())
    folder(old, rows(), study="second")
    if table:
        folder(new, table, study="second")
    comparison = compare(old, new)
    found = [*comparison.findings, *(change.metric for change in comparison.moved)]
    assert any(said in sentence for sentence in found) if said else found == []
    assert comparison.only_old == (2 if table is None else 2 - len(table))


def test_a_text_among_numbers_is_named(tmp_path):
    old, new = folder(tmp_path / "old", rows()), folder(tmp_path / "new", rows(**{"force_end [%]": "abc"}))
    with pytest.raises(StudyError, match=r"text among the numbers of its column 'force_end \[%\]'"):
        compare(old, new)


@pytest.mark.parametrize("old", [{}, {"reference": "2027.1 0a0a0a0a"}])
def test_errors_against_two_references_are_not_judged(tmp_path, old):
    """The force moved by ten times its uncertainty, but its reference differs; a number without a reference moved."""
    before = folder(tmp_path / "old", rows(**old))
    new = {"reference": "2027.2 0b0b0b0b", "force_end [%]": -25.0, "min_j [1]": 0.5}
    comparison = compare(before, folder(tmp_path / "new", rows(**new)))
    assert Verdict.MOVED not in verdicts_of(comparison) and Verdict.OTHER_REFERENCE in verdicts_of(comparison)
    assert Verdict.OTHER_REFERENCE not in verdicts_of(comparison, "min_j")


@pytest.fixture
def drawn(results):
    """Finished results with their table."""
    study = tiny_study()
    runs, _ = load_runs(results, study)
    link_study(Ledger(results), "tiny")
    write_table(results / "tiny" / "tiny.csv", study_table(runs, ("volume_worst", "min_j", "step_time")))
    return results


def edited(folder, **changes):
    """A record of a run with other attributes, or arrays: functions of the stored ones."""
    path = next(path for path in record_files(folder, "tiny") if read_record(path).status == "ok")
    record = read_record(path)
    fields = {
        name: replace(item, values=changes[name](item.values)) if name in changes else item
        for name, item in record.fields.items()
    }
    attributes = {name: changes[name](x) if name in changes else x for name, x in record.attributes.items()}
    status = changes.get("status", record.status)
    write_record(path, replace(record, fields=fields, attributes=attributes, status=status))


def infinite(values):
    return np.where(np.arange(len(values))[:, None, None] == 1, np.inf, values)


def in_table(folder, column, value):
    path = folder / "tiny" / "tiny.csv"
    table = pd.read_csv(path)
    table[column] = table[column].astype(object)
    table.loc[table["status"] == "ok", column] = value
    write_table(path, table)


def remove(*paths):
    for path in paths:
        path.unlink()


PLANTED = {
    "nothing": (lambda folder: None, None),
    "the last bit": (lambda folder: edited(folder, volume=lambda v: np.nextafter(v, 1.0)), None),
    "the tables": (lambda folder: remove(folder / "tiny" / "tiny.csv"), None),
    "a record is deleted": (lambda folder: remove(record_files(folder, "tiny")[0]), "lacks 1 records"),
    "all are": (lambda folder: remove(*(folder / "tiny").glob("*.h5")), "holds a table alone"),
    "all but the index": (lambda folder: remove(*record_files(folder, "tiny")), "rows in its table without a record"),
    "the study is": (lambda folder: (folder / "tiny").rename(folder / "another"), "holds no results"),
    "a record is empty": (lambda folder: record_files(folder, "tiny")[0].write_bytes(b""), "was cut off"),
    "a time is empty": (lambda folder: next(folder.glob("tiny/*.timing.*")).write_bytes(b""), "was cut off"),
    "the status": (lambda folder: edited(folder, status="inverted"), "status"),
    "the force": (lambda folder: edited(folder, contact_force=lambda force: 1.1 * force), "contact_force"),
    "a volume": (lambda folder: edited(folder, volume=lambda volume: 1.001 * volume), "volume_worst"),
    "the least J": (lambda folder: edited(folder, min_j=lambda j: 0.99 * j), "min_j"),
    "a force on the way": (lambda folder: edited(folder, contact_force=infinite), "contact_force"),
    "J is lost": (lambda folder: edited(folder, min_j=lambda j: np.nan * j), "min_j"),
    "penetration": (lambda folder: edited(folder, penetration=lambda depth: depth + 1e-4), "penetration"),
    "positions": (lambda folder: edited(folder, snapshots=lambda x: 1.02 * x), "snapshots"),
    "a count": (lambda folder: edited(folder, springs=lambda count: count + 1), "springs"),
    "the step": (lambda folder: edited(folder, dt=lambda dt: 1.001 * dt), "dt"),
    "a number in the table": (lambda folder: in_table(folder, "volume_worst [%]", 99.0), "volume_worst"),
    "a row in the table": (lambda folder: in_table(folder, "scene", "other"), "without a record"),
}
"""What is done to a copy of a folder -> what is said to have moved, or is missing; None: nothing."""


@pytest.mark.parametrize("name", PLANTED)
def test_what_was_done_to_a_folder_is_found(drawn, tmp_path, organbench, name):
    other = shutil.copytree(drawn, tmp_path / "other")
    plant, found = PLANTED[name]
    plant(other)
    comparison = compare(str(drawn), str(other))
    said = [*comparison.findings, *(change.metric for change in comparison.moved)]
    assert any(found in sentence for sentence in said) if found else said == []
    if name in ("nothing", "a record is deleted"):
        assert organbench("compare", drawn, other)[0] == (found is not None)


def test_a_folder_with_tables_alone_is_compared_with_the_records_of_another(drawn, tmp_path):
    published = tmp_path / "published"
    (published / "tiny").mkdir(parents=True)
    shutil.copy(drawn / "tiny" / "tiny.csv", published / "tiny")
    comparison = compare(published, drawn)
    assert comparison.moved == comparison.findings == [] and len(comparison.changes) > 5
    edited(drawn, min_j=lambda j: 0.99 * j)
    comparison = compare(published, drawn)
    assert {change.metric for change in comparison.moved} == {"min_j"}
    assert "table that is not of its records" in comparison.findings[0]


def spoilt(path):
    made = folder(path, rows())
    (made / "made_up" / "made_up.csv").write_bytes(b"")
    return made


REFUSED = {
    "there is no folder": lambda path: path / "nowhere",
    "no table of a study": lambda path: folder(path, [{"a": 1}]),
    "have no case in common": lambda path: folder(path, rows(), study="another"),
    "cannot be read as a table": spoilt,
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_folders_that_cannot_be_compared_are_refused_in_a_sentence(tmp_path, sentence):
    with pytest.raises(StudyError, match=sentence):
        compare(REFUSED[sentence](tmp_path / "old"), folder(tmp_path / "new", rows()))


TIMED = {"nodes": 550, "step_time [µs]": 20.0, "step_time floor [µs]": 0.5, "real_time [s/s]": 8.0}
SLOW = {"step_time [µs]": 40.0, "real_time [s/s]": 4.0}


def timed(path, machine, **changes):
    made = folder(path, [TIMED | row for row in rows(**changes)])  # times before accuracy
    if machine:
        (made / "machine.json").write_text(f'{{"id": "{machine}"}}')
    return made


@pytest.mark.parametrize("machines", [("one", "other"), ("", ""), ("one", "one")])
def test_times_are_judged_on_one_machine_alone(tmp_path, organbench, machines):
    old, new = timed(tmp_path / "old", machines[0]), timed(tmp_path / "new", machines[1], **SLOW)
    comparison, same = compare(old, new), machines == ("one", "one")
    verdicts = {change.metric: change.verdict for change in comparison.changes if change.old != change.new}
    assert verdicts == {
        "step_time": Verdict.MOVED if same else Verdict.OTHER_MACHINE,
        "real_time": Verdict.NOT_RESOLVABLE if same else Verdict.OTHER_MACHINE,
    }
    disturbed = timed(tmp_path / "disturbed", machines[1], **SLOW, disturbed="the program waited 20 % of a repeat")
    assert Verdict.MOVED not in {change.verdict for change in compare(old, disturbed).changes}
    code, out, _ = organbench("compare", old, new)
    assert code == same and ("median ratio 1.5 (new / old), 4 times not judged" in out) != same


def test_accuracy_that_moves_comes_before_times(tmp_path):
    worse = timed(tmp_path / "same", "one", **{"force_end [%]": -31.0}, **SLOW)
    moved = compare(timed(tmp_path / "old", "one"), worse).moved
    assert [change.metric for change in moved] == [
        "force_end",
        "step_time",
    ]


def test_the_published_tables_have_no_two_equal_rows():
    comparison = compare(PUBLISHED, PUBLISHED)
    shown = [tuple(row[:4]) for row in rows_of(comparison.changes, comparison)]
    assert len(shown) > 5000 and len(set(shown)) == len(shown)


def test_the_command_prints_markdown_and_ends_with_one_where_something_moved(tmp_path, organbench):
    old, new = folder(tmp_path / "old", rows()), folder(tmp_path / "new", rows(**{"force_end [%]": -31.0}))
    code, out, _ = organbench("compare", old, new, "--csv", tmp_path / "all.csv")
    assert code == 1 and "| made_up | ball | surface, free, {} | force_end [%] | −30 | −31 | −1 | 0.5 |" in out
    assert len(pd.read_csv(tmp_path / "all.csv")) == 4
    code, out, _ = organbench("compare", old, old)
    assert code == 0 and "0 moved" in out
    code, _, err = organbench("compare", tmp_path / "nowhere", new)
    assert code == 2 and err.count("\n") == 1
