"""Processes that this one starts, as copies of one that has imported what they need: for most that takes longest.

The mesher's and those of a sweep are copied. A process whose variables differ from those of the one that is copied is a
new one: libraries read them while they are loaded.
"""

import multiprocessing
import os
import runpy
import subprocess
import sys
from collections.abc import Mapping
from multiprocessing.connection import Connection
from multiprocessing.forkserver import ensure_running
from unittest import mock

from massspring.sources import ROOT

MAKERS = ("studies.geometry.mesher.organ_recipe", "studies.geometry.mesher.scan_recipe")
"""Modules that a mesher's process runs."""
IMPORTED = (__name__, *MAKERS, "studies.sweep.local", "studies.runs.run", "studies.reference.solve")
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
ANY = ("ORGANBENCH_", "PYTEST_", "PYTHONPATH", "KMP_", "PYPARDISO_")
"""Variables beginning so are read when they are needed, or set by a library as it is loaded."""
BEFORE = dict(os.environ)
"""Variables before the first test."""
POSIX = "forkserver" in multiprocessing.get_all_start_methods()
SPAWN = multiprocessing.get_context("spawn")
PIPE = subprocess.PIPE


def can_be_copied(environment: Mapping[str, str]) -> bool:
    """Whether the variables that libraries read are those of the process that is copied."""
    first, now = (
        {name: value for name, value in every.items() if name not in ONE_THREAD and not name.startswith(ANY)}
        for every in (BEFORE, environment)
    )
    return POSIX and now == first


if POSIX:
    FORKED = multiprocessing.get_context("forkserver")

    class Copy(FORKED.Process):
        """A copy, which gets the variables that this process has when it is started."""

        def start(self) -> None:
            """Starts the process that is copied first, where it is not there."""
            self.environment = dict(os.environ)
            multiprocessing.set_forkserver_preload(list(IMPORTED))
            with mock.patch.dict(os.environ, BEFORE | ONE_THREAD | {"PYTHONPATH": str(ROOT)}, clear=True):
                ensure_running()
            super().start()

        def run(self) -> None:
            """In the copy."""
            os.environ.clear()
            os.environ.update(self.environment)
            super().run()


class Sweeping:
    """As much of a context of multiprocessing as studies.base.processes uses."""

    Pipe = staticmethod(SPAWN.Pipe)

    @staticmethod
    def Process(**how):
        """A process that is not started."""
        return (Copy if can_be_copied(os.environ) else SPAWN.Process)(**how)


class Meshing:
    """As much of `subprocess.Popen` as studies.geometry.mesher.process uses."""

    def __init__(self, words: list[str], stdin: int, stderr) -> None:
        """`words`: those after python -m."""
        reading, writing = os.pipe()
        self.stdout = os.fdopen(reading)
        ends = [Connection(os.dup(stdin), writable=False)]
        ends += [Connection(number, readable=False) for number in (writing, os.dup(stderr.fileno()))]
        self.process = Copy(target=become, args=(words, ends))
        self.process.start()
        for end in ends:
            end.close()

    def wait(self) -> int | None:
        """Waits for its end: its exit code."""
        self.process.join()
        return self.process.exitcode

    def kill(self) -> None:
        """Ends it, where it lives."""
        self.process.kill()


def become(words: list[str], ends: list[Connection]) -> None:
    """In the copy: does what `python -m` does with these words, its standard streams being `ends`."""
    for number, end in enumerate(ends):
        os.dup2(end.fileno(), number)
    sys.argv = words
    runpy.run_module(words[0], run_name="__main__", alter_sys=True)


def Popen(command: list[str], *, env: Mapping[str, str], stdin: int, stdout: int, stderr, text: bool):
    """A copy for a command of the mesher, and else a new process."""
    if can_be_copied(env) and command[1] == "-m" and command[2] in MAKERS:
        return Meshing(command[2:], stdin, stderr)
    return subprocess.Popen(command, env=env, stdin=stdin, stdout=stdout, stderr=stderr, text=text)
