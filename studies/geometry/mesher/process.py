"""Runs a process that makes a mesh, reports its stages, and stops it if it takes too long."""

import os
import queue
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from massspring.sources import ROOT
from studies.geometry.mesher.progress import BEAT, WAITING

PATIENCE = 20.0
"""Limit of the wall time over that of the processor time, for a process that waits for ever and uses none."""
STOPPED = (-signal.SIGKILL, -getattr(signal, "SIGPROF", signal.SIGKILL)) if hasattr(signal, "SIGKILL") else (1,)
"""Exit codes of a process that was stopped at a limit."""


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
    lines: queue.Queue[str | None] = queue.Queue()
    with tempfile.TemporaryFile("w+") as complaints, pipe_to_here() as alive:
        process = subprocess.Popen(
            command, env=environment, stdin=alive, stdout=subprocess.PIPE, stderr=complaints, text=True
        )
        killer = threading.Timer(PATIENCE * limit, process.kill)
        reader = threading.Thread(target=read_lines, args=(process, lines), daemon=True)
        killer.start()
        reader.start()
        try:
            stage = last_stage(lines, name)
            code = process.wait()
        finally:
            killer.cancel()
            process.kill()  # after Ctrl-C; else the process has ended
            process.wait()
            reader.join()
            if process.stdout is not None:
                process.stdout.close()
        complaints.seek(0)
        return code, stage, (complaints.read().strip().splitlines() or ["no message"])[-1]


def read_lines(process: subprocess.Popen[str], lines: queue.Queue[str | None]) -> None:
    """Puts every line that a process prints into the queue, then None."""
    if process.stdout is not None:
        for line in process.stdout:
            lines.put(line.strip())
    lines.put(None)


def last_stage(lines: queue.Queue[str | None], name: str) -> str:
    """Logs each stage as it comes, and every BEAT seconds how long it has taken; returns the last stage."""
    stage, since = "", time.monotonic()
    while True:
        try:
            line = lines.get(timeout=BEAT)
        except queue.Empty:
            WAITING.info("%s: %s, for %.0f s", name, stage or "starting", time.monotonic() - since)
            continue
        if line is None:
            return stage
        stage, since = line, time.monotonic()
        WAITING.info("%s: %s", name, stage)
