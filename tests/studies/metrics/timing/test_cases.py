"""Frame times have files of their own: timing again never changes physics, and methods of one body take turns."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Free, simulate
from studies.base.errors import StudyError
from studies.metrics.timing import cases as module
from studies.metrics.timing.cases import time_cases, timing_file, timing_of
from studies.runs.current import case_path
from studies.runs.prepare import prepare
from studies.store import ledger
from studies.store.entry import CODE_CHANGED, MISSING
from studies.store.machine import machine_id, this_machine
from studies.store.record import Status, read_record, write_record
from studies.sweep import job as jobs_module
from studies.sweep.load import frame_times
from tests.studies.tiny import FRAMES, diverging_case, tiny_case

KEPT, LOOSE = tiny_case(timed=True), tiny_case(method=Free(), timed=True)


def test_a_file_beside_the_physics_holds_frames_and_stages(results):
    file, physics = timing_file(results, "tiny", KEPT), case_path(results, "tiny", KEPT)
    assert file.name == f"{physics.stem}.timing.{machine_id()}.h5"
    record = read_record(file)
    assert (record.kind, record.status, record.key) == ("timing", Status.OK, KEPT.key)
    assert record.fields["frame_ns"].values.shape == (module.REPEATS, FRAMES)
    assert record.fields["frame_ns"].unit == "ns" and record.attributes["threads"] == 1
    wall, own = (record.fields[name].values for name in ("frame_ns", "cpu_ns"))
    assert own.shape == wall.shape and 0 < own.sum() < 1.5 * wall.sum()  # both are of the same spans
    assert record.attributes["processor"] == this_machine().cpu
    read, copied = timing_of(record), ("core", "threads", "others", "processor", "disturbed")
    assert {name: getattr(read, name) for name in copied} == {name: record.attributes.get(name) for name in copied}
    assert np.array_equal(read.cpu_ns, own)
    assert "frame_ns" not in read_record(physics).fields
    stages, times = record.fields["stages"].values.tolist(), record.fields["stage_ns"].values
    assert times.shape == (len(stages), FRAMES) and (times >= 0).all()
    for stage in ("springs and prediction", "contact search"):
        assert (times[stages.index(stage)] > 0).all()


def why_untimed(root, case):
    return ledger.Ledger(root).why_untimed(jobs_module.CaseJob(root, "tiny", case))


def can_be_timed(root, case):
    return ledger.Ledger(root).can_be_timed(jobs_module.CaseJob(root, "tiny", case))


def test_current_until_the_code_changes_or_on_another_machine(results, monkeypatch):
    assert why_untimed(results, KEPT) is None
    for caller in (module, jobs_module):
        monkeypatch.setattr(caller, "case_fingerprint", lambda case: "edited")
    assert why_untimed(results, KEPT) == CODE_CHANGED
    assert frame_times(ledger.Ledger(results), jobs_module.CaseJob(results, "tiny", KEPT)) is None
    monkeypatch.undo()
    monkeypatch.setattr(ledger, "machine_id", lambda: "00000000")
    assert why_untimed(results, KEPT) == MISSING


def test_what_diverged_or_never_ran_is_not_timed(results):
    assert not timing_file(results, "tiny", diverging_case()).exists()
    assert not can_be_timed(results, diverging_case())
    assert not can_be_timed(results, tiny_case(dt_fraction=0.3))
    for status in (Status.FOLDED, Status.INVERTED, Status.DRIFTED, Status.TIMED_OUT, Status.FAILED):
        path = case_path(results, "tiny", KEPT)
        write_record(path, replace(read_record(path), status=status))
        assert can_be_timed(results, KEPT) == (status in (Status.FOLDED, Status.INVERTED, Status.DRIFTED))


def test_methods_of_one_body_take_turns(results, monkeypatch):
    """What counts is their ratio: a slow minute of the machine must fall on both. Another step is another group."""
    turns = []

    def spy(setup, **warm_up):
        if not warm_up:
            turns.append((setup.method.name, setup.clock.steps))
        return simulate(setup, **warm_up)

    monkeypatch.setattr(module, "simulate", spy)
    other = tiny_case(dt_fraction=0.25, timed=True)
    names = []
    time_cases(results, "tiny", [KEPT, other, LOOSE], names.append)
    steps, finer = (prepare(case).setup.clock.steps for case in (KEPT, other))
    assert steps != finer
    pairs = [turns[k : k + 2] for k in range(0, 2 * module.REPEATS, 2)]
    assert all({name for name, _ in pair} == {"implicit_volume", "free"} for pair in pairs)
    assert {pair[0][0] for pair in pairs} == {"implicit_volume", "free"}  # each goes first now and then
    assert turns[len(pairs) * 2 :] == [("implicit_volume", finer)] * module.REPEATS
    assert sorted(names) == sorted([KEPT.name, other.name, LOOSE.name])


def test_a_long_run_is_timed_less_often(monkeypatch):
    setup = prepare(KEPT).setup
    assert module.repeats_for(setup) == module.REPEATS
    monkeypatch.setattr(module, "BUDGET", 1e-9)
    assert module.repeats_for(setup) == module.FEWEST


def test_a_run_that_breaks_off_while_timed_is_not_stored(results, monkeypatch):
    before = {path.name: path.read_bytes() for path in (results / "tiny").iterdir()}
    monkeypatch.setattr(module, "prepare", lambda case: prepare(diverging_case()))
    with pytest.raises(StudyError, match=r"positive"):
        time_cases(results, "tiny", [KEPT], lambda name: None)
    assert {path.name: path.read_bytes() for path in (results / "tiny").iterdir()} == before
