"""A process that dies costs the piece that it had, not the sweep."""

import multiprocessing
import os
import signal
import time
from dataclasses import dataclass
from operator import methodcaller
from pathlib import Path

import pytest

from studies.base import processes
from studies.base.errors import StudyError
from studies.base.processes import Child, run_each
from tests.copies import SPAWN


@pytest.fixture(autouse=True)
def new_processes(monkeypatch):
    """As in a command: elsewhere in the tests they are copies of one."""
    monkeypatch.setattr(processes, "SPAWN", SPAWN)


class Piece:
    """A task that does nothing."""

    label = "piece"

    def perform(self):
        return None


class Doomed(Piece):
    """A task whose process is killed, as by a system out of memory."""

    def perform(self):
        os.kill(os.getpid(), signal.SIGKILL)


class Starved(Piece):
    """A task that is too large."""

    def perform(self):
        raise MemoryError


@dataclass
class Unlucky(Piece):
    """A task whose process is killed a number of times, then not; a file counts."""

    tries: Path
    deaths: int

    def perform(self):
        with open(self.tries, "a") as file:
            file.write(".")
        if self.tries.stat().st_size <= self.deaths:
            os.kill(os.getpid(), signal.SIGKILL)


@dataclass
class Refused(Piece):
    """A task that raises an error of a kind."""

    kind: type[Exception]

    def perform(self):
        raise self.kind("the disk is full")


class Unsendable(Exception):
    """An error that cannot be made again from its arguments."""

    def __init__(self, one, two="odd"):
        super().__init__(one, two, "more")


def swept(tasks, jobs=2):
    """Number of tasks done, and the causes of those that died."""
    ended = list(run_each(tasks, jobs, methodcaller("perform")))
    return len(ended), [(task, cause) for task, _, cause in ended if cause is not None]


def test_a_process_that_dies_costs_its_piece_alone():
    doomed, starved = Doomed(), Starved()
    done, died = swept([Piece(), doomed, Piece(), starved, Piece()])
    assert done == 5 and len(died) == 2
    causes = {type(task): cause for task, cause in died}
    assert causes[Doomed].startswith("its process died 3 times: killed by SIGKILL")
    assert causes[Starved] == "its process died 3 times: it ran out of memory"


@pytest.mark.parametrize(("deaths", "lost"), [(2, 0), (3, 1)])
def test_a_piece_is_tried_three_times(tmp_path, deaths, lost):
    done, died = swept([Unlucky(tmp_path / "tries", deaths), Piece()], jobs=1)
    assert (done, len(died)) == (2, lost)
    assert (tmp_path / "tries").stat().st_size == 3


def test_what_a_piece_raises_is_raised_here():
    with pytest.raises(StudyError, match="the disk is full") as stop:
        swept([Refused(StudyError), Piece()], jobs=1)
    assert "in perform" in stop.value.__notes__[0], "the lines where it was raised"
    with pytest.raises(RuntimeError, match=r"Unsendable: .*the disk is full"):
        swept([Refused(Unsendable)], jobs=1)


def test_a_process_that_cannot_begin_says_why():
    with pytest.raises(StudyError, match=r"mine\.py cannot be loaded"):
        list(run_each([Piece()], 1, methodcaller("perform"), cannot_begin))


def cannot_begin(tell):
    raise StudyError("mine.py cannot be loaded")


def test_whoever_stops_listening_leaves_no_process():
    ended = run_each([Piece(), Sleeper()], 2, methodcaller("perform"))
    next(ended)
    ended.close()
    assert not multiprocessing.active_children()


class Sleeper(Piece):
    """A task that takes long."""

    def perform(self):
        time.sleep(600)


def environment_of(name):
    return os.environ.get(name)


def test_a_process_has_its_variables_and_this_one_keeps_its_own(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    variables = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    ended = list(run_each(list(variables), 2, environment_of, environment=variables))
    assert [(one.result, one.cause) for one in ended] == [("1", None)] * 2
    assert os.environ["OMP_NUM_THREADS"] == "7" and "MKL_NUM_THREADS" not in os.environ


def test_a_process_that_is_dead_before_it_gets_a_job_is_no_error_here():
    child = Child()
    child.process.kill()
    child.process.join()
    child.give(environment_of, "HOME")
    assert str(child.hear()).startswith("killed by SIGKILL")
    child.end()
