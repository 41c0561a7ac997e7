"""What died or cannot be meshed is stored as failed; two commands may work on one folder."""

import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.metrics.timing.alone import alone
from studies.reference.reference_solves import STUDY as REFERENCES
from studies.reference.reference_solves import reference_solves
from studies.runs.current import case_path
from studies.scene.library import BALL_CLAMPED
from studies.store.ledger import Ledger
from studies.store.record import Status, peek, read_record, write_record
from studies.sweep.job import ReferenceJob, do, jobs_of
from studies.sweep.load import load_runs
from studies.sweep.local import environment
from studies.sweep.run_studies import Failures
from studies.sweep.standings import failed, standings
from tests.studies.octant import SCENE
from tests.studies.tiny import tiny_case, tiny_study

ROOT = Path(__file__).parents[3]
FATAL = """
import os, signal
from dataclasses import dataclass
from typing import ClassVar

from massspring import Free
from tests.studies.octant import SCENE
from tests.studies.tiny import tiny_case, tiny_study


@dataclass(frozen=True)
class Fatal(Free):
    name: ClassVar[str] = "fatal"

    def advance(self, state, boundary):
        os.kill(os.getpid(), signal.SIGKILL)


STUDY = tiny_study(cases=(tiny_case(method=Fatal()), tiny_case(method=Free())))
"""
"""A study with a case that ends its process."""


def test_a_piece_that_died_is_stored_as_failed(tmp_path):
    case = tiny_case(scene=SCENE)
    jobs, failures = jobs_of(tmp_path, [tiny_study(cases=(case,))]), Failures()
    for job in jobs:
        failures.add(job, "its process died")
    ledger = Ledger(tmp_path)
    assert all(ledger.why(job) is None and failed(ledger, job) for job in jobs)
    (run,), remarks = load_runs(tmp_path, tiny_study(cases=(case,)))
    assert (run.record.status, run.record.message) == (Status.FAILED, "its process died")
    assert "the reference of 'ball_squeeze' is failed: its process died" in remarks[0]
    assert [standing.status for standing in standings(ledger, tiny_study(cases=(case,)))] == ["failed"] * 2
    sentence = failures.sentence("again")
    assert sentence.startswith(f"failed: {jobs[0].label} (its process died), and 1 more; all others are done")


def test_what_another_command_has_done_meanwhile_is_not_done_again(results):
    (job,) = (job for job in jobs_of(results, [tiny_study()]) if job.work == tiny_case(timed=True))
    planned = replace(job, initial_state=job.state)
    assert not planned.done_meanwhile(), "its file is that of the plan"
    path = job.path
    write_record(path, read_record(path))
    before = path.read_bytes(), path.stat().st_mtime_ns
    assert planned.done_meanwhile() and do(planned) == path
    assert (path.read_bytes(), path.stat().st_mtime_ns) == before
    write_record(path, replace(read_record(path), fingerprint="0"))
    assert not planned.done_meanwhile(), "that was other code"


def test_workers_get_caches_that_do_not_depend_on_their_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ORGANBENCH_CACHE", "meshes")
    monkeypatch.setenv("NUMBA_CACHE_DIR", "compiled")
    variables = environment()
    assert variables["ORGANBENCH_CACHE"] == str(tmp_path / "meshes")
    assert variables["NUMBA_CACHE_DIR"] == str(tmp_path / "compiled")
    assert variables["OMP_NUM_THREADS"] == "1"


def test_one_command_at_a_time_measures(tmp_path):
    lines = []
    program = "import sys; from pathlib import Path; from studies.metrics.timing.alone import alone\n"
    program += "with alone(Path(sys.argv[1]), lambda: print('waits', flush=True)): print('inside', flush=True)"
    command = [sys.executable, "-c", program, str(tmp_path)]
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    with alone(tmp_path):
        other = subprocess.Popen(command, env=env, stdout=subprocess.PIPE, text=True)
        assert other.stdout is not None
        lines.append(other.stdout.readline())
        time.sleep(0.2)
        assert other.poll() is None, "it waits"
    lines += other.stdout.read().splitlines(keepends=True)
    assert (other.wait(), lines) == (0, ["waits\n", "inside\n"])
    other.stdout.close()


SHAPE = "the body at rest does not keep the shape of its organ"
"""Of bodies as coarse as those of tests."""


@pytest.mark.slow
def test_a_case_that_ends_its_process_is_stored_and_the_rest_goes_on(organbench, tmp_path):
    file, results = tmp_path / "fatal.py", tmp_path / "results"
    file.write_text(FATAL)
    code, out, err = organbench("run", file, "--results", results)
    assert code == 1 and "tiny: 2 cases ran, charts in" in out
    assert "tiny: 2 cases: 1 ok, 1 failed\n  failed: its process died 3 times" in out
    (sentence,) = [line for line in err.splitlines() if SHAPE not in line]
    assert sentence.startswith("warning: failed: tiny_squeeze-tetrahedral-60-fatal-dt0.5 (its process died 3")
    assert sentence.endswith(f"all others are done, `organbench run {file} --only failed` retries")
    assert organbench("show", file, "--results", results)[1].splitlines()[0] == "tiny: 2 cases: 1 ok, 1 failed"
    code, out, _ = organbench("run", file, "--results", results)
    assert code == 1 and "tiny: nothing ran" in out, "what failed is known, does not run again, and is not forgotten"


@pytest.mark.campaign
def test_two_commands_on_one_folder_leave_what_one_leaves(finished_sweep, tmp_path):
    results, file = tmp_path / "results", tmp_path / "one.py"
    file.write_text("from tests.studies.tiny import tiny_case, tiny_study\nSTUDY = tiny_study(cases=(tiny_case(),))\n")
    command = [sys.executable, "-m", "studies", "run", str(file), "--results", str(results), "--jobs", "1"]
    both = [subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    for process in both:
        warned = process.communicate()[1].splitlines()
        assert all(SHAPE in line for line in warned) and process.returncode == 0
    by_one, by_two = (read_record(case_path(root, "tiny", tiny_case())) for root in (finished_sweep, results))
    for name, field in by_one.fields.items():
        assert np.array_equal(field.values, by_two.fields[name].values, equal_nan=field.values.dtype.kind == "f")
    assert not list(results.rglob("*.part")), "nothing half-written is left"


UNPUBLISHED = replace(BALL_CLAMPED, checkpoints=(1.0,))
"""Nobody published its reference."""


def refuse(*_):
    raise StudyError("ball: use more nodes")


def no_inverse(*_):
    """As for a stomach of the population, which ended a study of five hours."""
    return np.linalg.solve(np.zeros((1, 1)), np.ones(1))


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (refuse, "ball: use more nodes"),
        (no_inverse, "the equations of the reference cannot be solved: Singular matrix"),
    ],
)
def test_a_reference_that_cannot_be_solved_costs_one_scene_and_not_the_sweep(tmp_path, monkeypatch, fault, message):
    monkeypatch.setattr("studies.reference.solve.solve", fault)
    job = ReferenceJob(tmp_path, REFERENCES, reference_solves(UNPUBLISHED)[0])
    stored = peek(do(job))
    assert (stored.status, stored.message) == (Status.FAILED, message)
    assert Ledger(tmp_path).why(job) is None


def test_a_result_that_cannot_be_stored_ends_the_sweep(tmp_path, monkeypatch):
    monkeypatch.setattr("studies.reference.solve.solve", refuse)
    monkeypatch.setattr("studies.sweep.job.write_record", refuse)
    with pytest.raises(StudyError, match="use more nodes"):
        do(ReferenceJob(tmp_path, REFERENCES, reference_solves(UNPUBLISHED)[0]))
