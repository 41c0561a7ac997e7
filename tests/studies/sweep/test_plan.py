"""What a sweep would run is what it runs; how long it takes is read off what ran before; compiling is reported."""

import re
from collections import Counter
from dataclasses import replace
from functools import partial

import numba
import pytest

from studies.base.counting import amounts
from studies.base.processes import run_each
from studies.cli.progress import basis
from studies.metrics.timing.cases import timing_file
from studies.runs.current import case_path
from studies.scene.library import SCENES
from studies.store.entry import CODE_CHANGED, MISSING
from studies.store.ledger import Ledger
from studies.store.record import peek, read_record, write_record
from studies.sweep.local import begin
from studies.sweep.plan import COPY, PHYSICS, TIMING, Planned, expected, plan
from studies.sweep.run_studies import run_studies
from studies.sweep.standings import failed
from tests.studies.tiny import Silent, diverging_case, tiny_case, tiny_study


def stale(root, case):
    path = case_path(root, "tiny", case)
    write_record(path, replace(read_record(path), fingerprint="0"))
    return path


def test_from_nothing_everything_is_planned_with_an_estimate_by_its_size(tmp_path):
    pieces = plan(Ledger(tmp_path), tiny_study())
    assert sorted(p.kind for p in pieces) == ["case"] * 3 + ["timing"] * 3
    assert {p.seconds for p in pieces} == {None}
    assert {p.why for p in pieces} == {MISSING}
    assert all(p.guess > 0 and not p.here for p in pieces) and expected(pieces, 2) > 0


def test_what_is_planned_is_what_runs(results):
    path = stale(results, tiny_case(timed=True))
    timing_file(results, "tiny", tiny_study().cases[1]).unlink()
    pieces = plan(Ledger(results), tiny_study())
    assert [(p.stage, p.label, p.why) for p in pieces] == [
        (PHYSICS, tiny_case().name, CODE_CHANGED),
        (TIMING, tiny_study().cases[1].name, MISSING),
    ]
    assert pieces[0].seconds == peek(path).attributes["seconds"] > 0
    assert pieces[1].seconds is None
    watched = Silent()
    assert run_studies(results, [tiny_study()], 1, watched) == 2
    assert watched.done == [(p.stage, p.label) for p in pieces]
    assert plan(Ledger(results), tiny_study()) == []


def test_a_filter_plans_what_it_lets_run(results):
    stale(results, tiny_case(timed=True))
    assert plan(Ledger(results), tiny_study(), partial(failed, Ledger(results))) == []
    (piece, *_) = plan(Ledger(results), tiny_study(), lambda task: task.label == diverging_case().name)
    assert (piece.label, piece.why) == (diverging_case().name, "its result failed")


def piece(stage, kind, seconds):
    return Planned(stage, kind, f"{kind} {seconds}", "missing", seconds)


def test_the_estimate_shares_the_physics_and_not_the_timing():
    pieces = [piece(PHYSICS, "case", 4.0), piece(PHYSICS, "case", 2.0), piece(TIMING, "timing", 5.0)]
    assert expected(pieces, 1) == pytest.approx(11.0)
    assert expected(pieces, 2) == pytest.approx(9.0), "no sweep is shorter than its longest job"
    assert expected(pieces[1:2] + pieces, 2) == pytest.approx(9.0) and expected([], 2) == 0.0
    assert expected([*pieces, replace(piece(PHYSICS, "case", None), guess=3.0)], 1) == pytest.approx(14.0)
    assert expected([replace(piece(PHYSICS, "case", 2.0), guess=3.0)], 1) == pytest.approx(2.0), "measured counts first"


def test_a_dry_run_says_it_all_and_runs_nothing(organbench, tiny_file, results, tmp_path):
    code, out, err = organbench("run", tiny_file, "--dry-run", "--results", tmp_path / "empty")
    assert (code, err) == (0, "")
    assert not (tmp_path / "empty").exists()
    assert "tiny: 3 cases, 3 timings would run" in out
    assert re.search(r"  3 cases \(missing\): about \d+ s of computing\n", out)
    assert re.search(r"about \d+ s with 2 processes, from the rate of another machine for 3 cases, 3 timings;", out)
    stale(results, tiny_case(timed=True))
    code, out, _ = organbench("run", tiny_file, "--dry-run", "--results", results)
    assert re.search(r"  1 case \(the code has changed since\): about \d+ s of computing\n", out)
    assert "with 2 processes, from earlier runs of 1 case; compiling comes on top" in out
    code, out, _ = organbench("run", tiny_file, "--dry-run", "--only", "failed", "--results", results)
    assert out.strip() == "tiny: nothing would run: all results are current"


def test_a_published_reference_is_copied_and_has_no_rate(tmp_path):
    study = tiny_study(cases=(tiny_case(scene=SCENES[0]),))
    pieces = plan(Ledger(tmp_path), study)
    assert [piece.kind for piece in pieces][:2] == [COPY, "case"] and expected(pieces[:1], 1) == 0.0
    assert basis(pieces) == "from the rate of another machine for 1 case" and basis(pieces[:1]) == "only copies"
    assert amounts(Counter(piece.kind for piece in pieces)).startswith("1 case, 1 published reference")


def compile_something(task):
    fresh = numba.njit(lambda x: x + 1)
    assert fresh(1) == 2


def test_workers_report_what_they_compile():
    functions = []
    list(run_each(["compiles"], 1, compile_something, partial(begin, ()), tell=functions.append))
    assert functions == ["<lambda>"]
