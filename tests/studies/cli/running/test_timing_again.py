"""`organbench run --again timing`: stored cases are timed once more on this machine; none of them runs."""

from dataclasses import replace

import pytest

from studies.metrics.timing import cases as timed
from studies.metrics.timing.cases import timing_file
from studies.runs.current import case_path
from studies.store.archived import CRATE
from studies.store.ledger import Ledger
from studies.store.record import Status, read_record, write_record
from studies.sweep.executor import Silent
from studies.sweep.frame_times import measure_again
from studies.sweep.plan import AGAIN, TIMING, plan_again
from tests.studies.tiny import content, diverging_case, tiny_case, tiny_study

KEPT = tiny_case(timed=True)


def changed(before, after):
    """Names of records and frame times that are new or others."""
    return {path.name for path in after if path.suffix == ".h5" and before.get(path) != after[path]} - {"tiny.h5"}


@pytest.fixture
def quick(monkeypatch):
    """One repeat each."""
    monkeypatch.setattr(timed, "REPEATS", 1)


def test_all_times_are_new_and_no_run_is(organbench, tiny_file, results, quick):
    before = content(results / "tiny")
    code, out, _ = organbench("run", tiny_file, "--results", results, "--again", "timing")
    after = content(results / "tiny")
    timings = {timing_file(results, "tiny", case) for case in tiny_study().cases[:2]}
    assert code == 0 and "tiny: 2 stored cases were timed again" in out
    assert changed(before, after) == {path.name for path in timings}
    assert {read_record(path).fields["frame_ns"].values.shape[0] for path in timings} == {1}


def test_a_dry_run_says_what_and_how_long_and_times_nothing(organbench, tiny_file, results):
    before = content(results / "tiny")
    code, out, _ = organbench("run", tiny_file, "--results", results, "--again", "timing", "--dry-run")
    assert code == 0 and "tiny: 2 timings would run" in out and f"2 timings ({AGAIN}): about" in out
    assert content(results / "tiny") == before
    assert [(piece.stage, piece.label) for piece in plan_again(Ledger(results), tiny_study())] == [
        (TIMING, case.name) for case in tiny_study().cases[:2]
    ]


def test_one_case_alone(organbench, tiny_file, results, quick):
    before = content(results / "tiny")
    words = ("run", tiny_file, "--results", results, "--again", "timing", "--case", KEPT.name)
    assert organbench(*words)[0] == 0
    assert changed(before, content(results / "tiny")) == {timing_file(results, "tiny", KEPT).name}


def test_what_is_stale_broke_off_or_is_missing_is_not_timed(organbench, tiny_file, results):
    path = case_path(results, "tiny", KEPT)
    write_record(path, replace(read_record(path), fingerprint="0"))
    other = tiny_study().cases[1]
    assert [piece.label for piece in plan_again(Ledger(results), tiny_study())] == [other.name]
    path = case_path(results, "tiny", other)
    write_record(path, replace(read_record(path), status=Status.DIVERGED))
    assert plan_again(Ledger(results), tiny_study()) == [] and diverging_case() in tiny_study().cases
    before = content(results / "tiny")
    code, out, _ = organbench("run", tiny_file, "--results", results, "--again", "timing")
    assert code == 0 and "no stored case of this code can be timed" in out
    assert content(results / "tiny") == before


def test_old_times_stay_where_the_new_ones_are_not_whole(results, monkeypatch):
    """An interruption in the second case: the first is new, the second as before, and nothing half is left."""
    monkeypatch.setattr(timed, "REPEATS", 1)
    before, written = content(results / "tiny"), []
    write = timed.write_timing

    def second_fails(root, study, case, timing, seconds):
        if written:
            raise KeyboardInterrupt
        written.append(timing_file(root, study, case).name)
        write(root, study, case, timing, seconds)

    monkeypatch.setattr(timed, "write_timing", second_fails)
    with pytest.raises(KeyboardInterrupt):
        measure_again(Ledger(results), tiny_study(), Silent(), lambda name: None)
    assert changed(before, content(results / "tiny")) == set(written) and len(written) == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--again", "timings"), "unknown value of --again 'timings'; did you mean 'timing'"),
        (("--again", "timing", "--only", "failed"), "leave out --only"),
        (("--again", "timing", "--on", "local:2"), "leave out --on"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_what_does_not_go_together_is_one_sentence(refused, tiny_file, results, words, message):
    before = content(results / "tiny")
    assert message in refused("run", tiny_file, "--results", results, *words)
    assert content(results / "tiny") == before


def test_an_archive_stays_as_it_is(refused, tiny_file, results):
    (results / CRATE).write_text("{}")
    assert "is an unpacked archive" in refused("run", tiny_file, "--results", results, "--again", "timing")
