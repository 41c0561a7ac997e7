"""The process that makes a mesh, seen from both ends: `followed` runs it and logs its stages, `work` is what it does.

The mesher has a process of its own because gmsh hangs or crashes on some surfaces, and then takes its process with it;
because it is not thread-safe and keeps its options for the whole process; and because it is under the GPL, and this
project is not. The process is a new interpreter: multiprocessing's spawn would run a user's script again where that has
no `if __name__ == "__main__"`.
"""

import json
import logging
import os
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from massspring.sources import ROOT
from studies.base.errors import StudyError
from studies.base.interrupts import end_after

Arrays = dict[str, np.ndarray]
STAGES = logging.getLogger("organbench.mesher")
"""Logger of the waiting process, which gets each stage."""
PATIENCE = 20.0
"""Limit of the wall time over that of the processor time, for a process that waits for ever and uses none."""
STOPPED = (-signal.SIGKILL, -getattr(signal, "SIGPROF", signal.SIGKILL)) if hasattr(signal, "SIGKILL") else (1,)
"""Exit codes of a process that was stopped at a limit."""
LEAST = 1e-3
"""Smallest value [s] with which the timer starts: 0 would switch it off."""


@contextmanager
def pipe_to_here() -> Iterator[int]:
    """Standard input for a process that has to end with this one: it stays empty and closes when this process ends."""
    reading, writing = os.pipe()
    try:
        yield reading
    finally:
        os.close(reading)
        os.close(writing)


def followed(command: list[str], name: str, limit: float) -> tuple[int, str, str]:
    """Runs a command to its end and logs each stage that it prints; name: of the mesh, for the log.

    Returns exit code, last stage, and last line of standard error. The command limits its processor time; this function
    limits its wall time to PATIENCE times `limit` [s].
    """
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    one_thread = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    environment = os.environ | one_thread | {"PYTHONPATH": os.pathsep.join(paths)}
    stage = ""
    with tempfile.TemporaryFile("w+") as complaints, pipe_to_here() as alive:
        process = subprocess.Popen(
            command, env=environment, stdin=alive, stdout=subprocess.PIPE, stderr=complaints, text=True
        )
        # Its end closes the stream of stages, for which the loop below waits.
        killer = threading.Timer(PATIENCE * limit, process.kill)
        killer.start()
        try:
            assert process.stdout is not None
            with process.stdout as lines:
                for line in lines:
                    stage = line.strip()
                    STAGES.info("%s: %s", name, stage)
            code = process.wait()
        finally:
            killer.cancel()
            process.kill()  # after Ctrl-C; else the process has ended
            process.wait()
        complaints.seek(0)
        return code, stage, (complaints.read().strip().splitlines() or ["no message"])[-1]


def stage(what: str) -> None:
    """Reports the next stage from the mesher; the waiting process reads it from standard output."""
    print(what, flush=True)


def work(build: Callable[[dict[str, Any], Arrays], Arrays], job_path: str, out_path: str, limit: str) -> int:
    """Reads the job and writes the arrays of `build`, or the message of its StudyError. Returns the exit code, 0 or 2.

    It is called by `python -m MAKER JOB.npz OUT.npz SECONDS`, with a MAKER of jobs.MAKERS. Standard input is a pipe
    that the caller keeps open; the process ends when it closes, and after `limit` seconds of processor time, even
    inside a library.
    """
    end_after(lambda: os.read(0, 1))
    if hasattr(signal, "setitimer"):  # Windows has none; there only the clock of the caller limits the time
        signal.setitimer(signal.ITIMER_PROF, max(float(limit) - time.process_time(), LEAST))
    with np.load(job_path, allow_pickle=False) as job:
        arrays = {key: job[key] for key in job.files if key != "recipe"}
        recipe = json.loads(str(job["recipe"]))
    try:
        result = build(recipe, arrays)
    except StudyError as error:
        np.savez(out_path, error=np.array(str(error)))
        return 2
    np.savez(out_path, allow_pickle=False, **result)
    return 0
