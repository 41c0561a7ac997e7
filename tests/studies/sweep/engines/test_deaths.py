"""Workers, pieces and schedulers that die."""

import logging
import os
import subprocess
import sys
from pathlib import Path

import pytest
from distributed import LocalCluster

from studies.base.errors import StudyError
from studies.store.record import Status
from studies.sweep.failures import Failures
from studies.sweep.find_study import find_study
from studies.sweep.load import load_runs
from studies.sweep.run_studies import run_studies
from tests.studies.sweep.engines.conftest import address_in, assert_equal_bits, engine_at, physics, swept
from tests.studies.sweep.test_failures import FATAL
from tests.studies.tiny import FRAMES, Silent

pytestmark = pytest.mark.campaign
ROOT = Path(__file__).parents[4]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}
KILLS = """
import os, signal, time
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from massspring import Free
from tests.studies.tiny import tiny_case, tiny_study


@dataclass(frozen=True)
class Kills(Free):
    name: ClassVar[str] = "kills"
    folder: str = ""
    deadly: bool = False

    def advance(self, state, boundary):
        with open(Path(self.folder) / "frames", "a") as file:
            file.write(".")
        if self.deadly and not (Path(self.folder) / "killed").exists():
            (Path(self.folder) / "killed").touch()
            os.kill(os.getppid(), signal.SIGKILL)
            time.sleep(60)
        return super().advance(state, boundary)


FOLDER = str(Path(__file__).parent)
STUDY = tiny_study(cases=tuple(
    tiny_case(method=Kills(folder=FOLDER, deadly=fraction == 0.4), dt_fraction=fraction)
    for fraction in (0.5, 0.45, 0.4, 0.35, 0.3)
))
"""
"""A study in which one case kills the worker that has it, once; every frame leaves a mark."""
SLOW = """
import time
from dataclasses import dataclass
from typing import ClassVar

from massspring import Free
from tests.studies.tiny import tiny_case, tiny_study


@dataclass(frozen=True)
class Slow(Free):
    name: ClassVar[str] = "slow"
    seconds: float = 0.0

    def advance(self, state, boundary):
        time.sleep(self.seconds)
        return super().advance(state, boundary)


STUDY = tiny_study(cases=tuple(tiny_case(method=Slow(seconds=seconds)) for seconds in (0.0, 60.0)))
"""
"""A study with a case that does not end while one waits."""


def written(folder, text):
    """A study file of a user, loaded."""
    folder.mkdir(exist_ok=True)
    path = folder / "mine.py"
    path.write_text(text)
    return find_study(str(path))


@pytest.mark.campaign
def test_a_worker_that_is_killed_costs_no_case(tmp_path):
    study = written(tmp_path / "study", KILLS)
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": ":0", "silence_logs": logging.CRITICAL}
    with LocalCluster(**options) as cluster:
        count, progress = swept(tmp_path / "killed", study, cluster.scheduler_address)
    frames = tmp_path / "study" / "frames"
    assert (tmp_path / "study" / "killed").exists()
    assert count == 5 and sorted(note for _, note in progress.done) == sorted(case.name for case in study.cases)
    assert frames.stat().st_size == 5 * FRAMES + 1, "a finished piece does not run again, the killed one once"
    assert len(list((tmp_path / "killed" / "tiny").iterdir())) == 5, "each is stored once, nothing is half-written"
    run_studies(tmp_path / "undisturbed", [study], 1, Silent())
    assert_equal_bits(physics(tmp_path / "killed", study), physics(tmp_path / "undisturbed", study))


def test_a_case_that_ends_its_process_is_stored_as_failed_and_the_rest_goes_on(scheduler, tmp_path):
    fatal = FATAL.replace('"fatal"', '"fatal_there"')  # a process knows one method of each name
    study, failures = written(tmp_path / "study", fatal), Failures()
    swept(tmp_path / "results", study, scheduler, failures=failures)
    (cause,) = failures.causes.values()
    assert cause.startswith("its process died 3 times: killed by SIGKILL")
    runs, _ = load_runs(tmp_path / "results", study)
    assert [run.record.status for run in runs] == [Status.FAILED, Status.OK]


def started(words, log):
    """A program of this Python, whose words go to a file."""
    return subprocess.Popen([sys.executable, "-m", *words], cwd=ROOT, env=ENVIRONMENT, stdout=log, stderr=log)


class Killer(Silent):
    """Ends a process after the first piece."""

    def __init__(self, process):
        super().__init__()
        self.process = process

    def advance(self, what, note):
        super().advance(what, note)
        self.process.kill()


@pytest.mark.campaign
def test_a_scheduler_that_dies_half_way_is_one_sentence_and_what_is_finished_stays(tmp_path):
    study, file = written(tmp_path / "study", SLOW), tmp_path / "scheduler.json"
    words = ["--port", "0", "--no-dashboard", "--scheduler-file", str(file), "--host", "127.0.0.1"]
    with open(tmp_path / "log", "wb") as log:
        scheduler = started(["distributed.cli.dask_scheduler", *words], log)
        worker = started(["studies", "worker", "--scheduler-file", str(file)], log)
        try:
            address = address_in(file)
            gone = pytest.raises(
                StudyError, match=r"the Dask scheduler no longer answers.*run the same command to continue"
            )
            with gone, engine_at(address, 60.0) as engine:
                run_studies(tmp_path / "results", [study], engine, Killer(scheduler))
        finally:
            for process in (worker, scheduler):
                process.kill()
                process.wait()
    assert len(list((tmp_path / "results" / "tiny").iterdir())) == 1
