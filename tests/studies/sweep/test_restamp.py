"""Results that only a change of the code makes stale: kept where replays are equal, and only there."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.metrics.timing.cases import timing_file
from studies.reference.reference_solves import ReferenceSolve, reference_fingerprint
from studies.runs.current import case_fingerprint, case_path
from studies.store.entry import CODE_CHANGED
from studies.store.ledger import Ledger
from studies.store.record import Status, peek, read_record, write_record
from studies.sweep import restamp as module
from studies.sweep.job import case_jobs
from studies.sweep.restamp import AT_RANDOM, _odd_attribute, outdated, restamp, sample
from tests.studies.octant import SCENE
from tests.studies.tiny import tiny_case, tiny_study

FORMER = "f" * 64
CASES = tiny_study().cases


def reasons(root):
    """Why each case is stale, and why its frame times are."""
    ledger, jobs = Ledger(root), case_jobs(root, tiny_study())
    return [ledger.why(job) for job in jobs], [ledger.why_untimed(job) for job in jobs if ledger.timing(job)]


def change(path, **changes):
    record = read_record(path)
    changes["attributes"] = {**record.attributes, **changes.get("attributes", {})}
    write_record(path, replace(record, **changes))


@pytest.fixture
def old(results):
    """The finished tiny study as other code left it: three cases and their frame times."""
    for path in (results / "tiny").glob("*-*.h5"):
        change(path, fingerprint=FORMER)
    assert reasons(results) == ([CODE_CHANGED] * 3, [CODE_CHANGED] * 2)
    return results


def paths(root):
    return [case_path(root, "tiny", case) for case in CASES]


def test_equal_results_are_restamped_with_their_frame_times(old, organbench, tiny_file):
    before = [read_record(path) for path in paths(old)]
    code, out, _ = organbench("restamp", tiny_file, "--results", old)
    assert code == 0 and "3 results restamped" in out
    assert reasons(old) == ([None] * 3, [None] * 2)
    for was, path in zip(before, paths(old), strict=True):
        now = read_record(path)
        assert now.attributes.pop("restamped") == f"from {FORMER} by 3 replays"
        assert now.attributes == pytest.approx(was.attributes, nan_ok=True)
        for name, field in was.fields.items():
            np.testing.assert_array_equal(now.fields[name].values, field.values)
    assert "no result is stale" in organbench("restamp", tiny_file, "--results", old)[1]


def test_a_second_restamp_keeps_the_first_in_the_record(old):
    (members,) = outdated(old, [tiny_study()])
    assert restamp(members, members[:1], str) is None
    change(paths(old)[0], fingerprint="e" * 64)
    (members,) = outdated(old, [tiny_study()])
    assert restamp(members, members, str) is None
    assert peek(paths(old)[0]).attributes["restamped"] == f"from {FORMER} by 1 replays; from {'e' * 64} by 1 replays"


def one_bit(record):
    values = record.fields["volume"].values.copy()
    values.view(np.uint64)[0, 0] ^= 1
    return {"fields": {**record.fields, "volume": replace(record.fields["volume"], values=values)}}


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (one_bit, "'volume' differs by up to"),
        (lambda record: {"attributes": {"steps": record.attributes["steps"] + 1}}, "'steps' was"),
        (lambda record: {"attributes": {"warnings": ""}}, "'warnings' was ''"),
        (lambda record: {"status": Status.DRIFTED}, "it was drifted, now it is ok"),
    ],
)
def test_one_difference_and_nothing_is_restamped(old, organbench, tiny_file, spoil, sentence):
    path = paths(old)[0]
    change(path, **spoil(read_record(path)))
    before = {file: file.read_bytes() for file in (old / "tiny").iterdir()}
    code, out, _ = organbench("restamp", tiny_file, "--results", old)
    assert code == 1 and "not restamped" in out and sentence in out
    assert {file: file.read_bytes() for file in (old / "tiny").iterdir()} == before


def test_the_time_that_a_cut_took_is_no_result(old):
    """Two runs never take the same: records of cuts were never restamped."""
    record = read_record(paths(old)[0])
    changed = {**record.attributes, "cut_seconds": 0.1, "seconds": 2.0}
    assert _odd_attribute({**record.attributes, "cut_seconds": 0.2}, changed) is None
    assert _odd_attribute(record.attributes, {**changed, "dt": 1.0}) is not None


def test_a_dry_run_says_how_many_and_changes_nothing(old, organbench, tiny_file):
    before = [path.read_bytes() for path in paths(old)]
    code, out, _ = organbench("restamp", tiny_file, "--results", old, "--dry-run")
    assert code == 0 and "3 results of code ffffffff, 3 to replay" in out
    assert [path.read_bytes() for path in paths(old)] == before


@pytest.mark.parametrize("status", ["failed", "timed-out", "not-converged"])
def test_what_another_run_may_bring_further_stays_stale(old, status):
    change(paths(old)[0], status=Status(status))
    (members,) = outdated(old, [tiny_study()])
    assert sorted(one.path for one in members) == sorted(paths(old)[1:])


def test_other_reasons_to_be_stale_are_not_for_a_stamp(old):
    first, second, third = paths(old)
    first.unlink()
    second.write_bytes(second.read_bytes()[:500])
    change(third, key=tiny_case(frames=7).key)
    assert outdated(old, [tiny_study()]) == []


def test_each_former_code_needs_its_own_replays(old):
    change(paths(old)[0], fingerprint="e" * 64)
    assert [len(members) for members in outdated(old, [tiny_study()])] == [1, 2]


def test_a_result_that_has_run_again_meanwhile_is_left_alone(old):
    (members,) = outdated(old, [tiny_study()])
    change(paths(old)[0], fingerprint="e" * 64)
    assert restamp(members, members[1:], str) is None
    assert peek(paths(old)[0]).fingerprint == "e" * 64


def test_a_write_that_fails_loses_nothing(old, monkeypatch):
    (members,) = outdated(old, [tiny_study()])

    def full(path, record):
        raise StudyError("the disk is full")

    monkeypatch.setattr(module, "write_record", full)
    with pytest.raises(StudyError, match="disk is full"):
        restamp(members, members[:1], str)
    monkeypatch.undo()
    assert [read_record(path).fingerprint for path in paths(old)] == [FORMER] * 3
    (again,) = outdated(old, [tiny_study()])
    assert restamp(again, again[:1], str) is None
    assert peek(timing_file(old, "tiny", CASES[0])).fingerprint == case_fingerprint(CASES[0])


def test_a_sample_has_the_quickest_of_each_variety_and_three_others(old):
    (members,) = outdated(old, [tiny_study()])
    many = [
        replace(
            members[k % 2],
            path=old / f"{k}.h5",
            variety="ab"[k % 2],
            record=replace(members[0].record, attributes={"seconds": float(k)}),
        )
        for k in range(20)
    ]
    chosen = sample(many)
    assert {one.path.stem for one in chosen} >= {"0", "1"} and len({one.path for one in chosen}) == 2 + AT_RANDOM
    assert [one.path for one in sample(many[::-1])] == [one.path for one in chosen]
    with pytest.raises(ValueError, match="without a replay"):
        restamp(many, [], str)


def test_a_reference_is_solved_again_elsewhere(solved, tmp_path, monkeypatch):
    """By a solver that gives the same bits: a sparse solver may differ in the last ones from one process to another."""
    whole, folders = ReferenceSolve(SCENE), []

    def again(folder, solve):
        folders.append(folder)
        (folder / "reference").mkdir()
        return shutil.copy(whole.path(solved), solve.path(folder))

    monkeypatch.setattr("studies.sweep.restamp.solve", again)
    path = whole.path(tmp_path)
    path.parent.mkdir()
    shutil.copy(whole.path(solved), path)
    change(path, fingerprint=FORMER)
    study = tiny_study(cases=(tiny_case(scene=SCENE),))
    (members,) = outdated(tmp_path, [study])
    assert restamp(members, sample(members), str) is None
    assert peek(path).fingerprint == reference_fingerprint()
    assert peek(path).attributes["restamped"] == f"from {FORMER} by 1 replays"
    assert tmp_path not in folders and not folders[0].exists()
    change(path, fingerprint=FORMER, attributes={"unknowns": 1})
    (members,) = outdated(tmp_path, [study])
    assert "'unknowns' was 1, now it is" in str(restamp(members, members, str))
    assert peek(path).fingerprint == FORMER
