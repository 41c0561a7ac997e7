"""What moved between two results folders: verdicts, rows that belong together, folders that cannot be compared."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from studies.base.errors import StudyError
from studies.cli.commands.compare import rows_of
from studies.metrics.compare_folders import ROUND_OFF, Verdict, compare, equal_records, verdict_of
from studies.store.paths import record_files
from studies.store.record import read_record, write_record
from studies.store.tables import write_table

PUBLISHED = Path(__file__).parents[3] / "results" / "published"
NAN = float("nan")


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


@pytest.mark.parametrize("old", [{}, {"reference": "2027.1 0a0a0a0a"}])
def test_errors_against_two_references_are_not_judged(tmp_path, old):
    """The force moved by ten times its uncertainty, but its reference differs; a number without a reference moved."""
    before = folder(tmp_path / "old", rows(**old))
    new = {"reference": "2027.2 0b0b0b0b", "force_end [%]": -25.0, "min_j [1]": 0.5}
    comparison = compare(before, folder(tmp_path / "new", rows(**new)))
    assert Verdict.MOVED not in verdicts_of(comparison) and Verdict.OTHER_REFERENCE in verdicts_of(comparison)
    assert Verdict.OTHER_REFERENCE not in verdicts_of(comparison, "min_j")


def test_records_are_compared_to_the_last_bit(results, tmp_path):
    other = tmp_path / "other"
    shutil.copytree(results, other)
    before = equal_records(results, other, "tiny")
    assert len(before) == len(record_files(results, "tiny"))
    path = record_files(other, "tiny")[0]
    record = read_record(path)
    volume = record.fields["volume"]
    nudged = replace(volume, values=np.nextafter(volume.values, 1.0))
    write_record(path, replace(record, fields={**record.fields, "volume": nudged}))
    assert len(equal_records(results, other, "tiny")) == len(before) - 1
    path.write_bytes(b"cut off")
    assert len(equal_records(results, other, "tiny")) == len(before) - 1


def spoilt(path):
    made = folder(path, rows())
    (made / "made_up" / "made_up.csv").write_bytes(b"")
    return made


REFUSED = {
    "there is no folder": lambda path: path / "nowhere",
    "holds no table of a study": lambda path: folder(path, [{"a": 1}]),
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
