"""A cluster for one command: a scheduler here, and workers from a queueing system or a program, ended with it."""

import json
import logging
import os
import secrets
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from dask import config
from distributed import LocalCluster
from distributed.utils import get_ip

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.engines.scripts import QUEUES, script
from studies.engines.settings import Settings
from studies.engines.tls import KEY, make_key, settings_of
from studies.sweep.workers import PATIENCE

QUEUE_SECONDS = 60.0
"""That a queueing system may take to answer."""
Told = Callable[[str], object]


@contextmanager
def scheduler_with_jobs(settings: Settings, root: Path, tell: Told) -> Iterator[str]:
    """The address of a scheduler of this process, for which workers are started; `tell` hears how. Inside, clients of
    this process hold its key; without it nobody talks to the scheduler.

    Raises StudyError where they cannot be started."""
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    folder = root.absolute() / "cache" / f"workers-{secrets.token_hex(4)}"
    file = folder / "scheduler.json"
    host = settings.host or get_ip()
    make_key(folder)
    options = {"host": host, "scheduler_port": 0, "silence_logs": logging.CRITICAL}
    no_pages = {"dashboard_address": "127.0.0.1:0", "scheduler_kwargs": {"dashboard": False}}
    with config.set(settings_of(folder)), LocalCluster(n_workers=0, **options, **no_pages) as cluster:
        address: str = cluster.scheduler_address  # pyright: ignore[reportAttributeAccessIssue]
        write_whole(file, json.dumps({"address": address}).encode())
        started = _commands if settings.kind == "command" else _array
        try:
            with started(settings, folder, file, tell):
                yield address
        finally:
            for gone in (file, folder / KEY):
                gone.unlink(missing_ok=True)


def worker_command(settings: Settings, file: Path) -> list[str]:
    """The words that start a worker on any machine that shares folders and Python with this one."""
    memory = ["--memory", f"{settings.memory_gb:g}"] if settings.memory_gb else []
    start = [sys.executable, "-m", "studies", "worker", "--scheduler-file", str(file)]
    return [*start, "--processes", str(settings.processes), *memory]


@contextmanager
def _array(settings: Settings, folder: Path, file: Path, tell: Told) -> Iterator[None]:
    queue = QUEUES[settings.kind]
    job_script = folder / "workers.sh"
    write_whole(job_script, script(settings, folder, worker_command(settings, file), Path.cwd()).encode())
    answer = _asked([*queue.submit, str(job_script)])
    found = queue.job.search(answer)
    if found is None:
        raise StudyError(f"{queue.submit[0]} took {job_script} and named no job, but said: {answer!r}")
    tell(f"job {found[0]} with {settings.workers} workers; what they print is in {folder}")
    try:
        yield
    finally:
        _asked([queue.end, found[0]])


def _asked(command: list[str]) -> str:
    """What a program of a queueing system says. Raises StudyError where it refuses, or is not there."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=QUEUE_SECONDS)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise StudyError(
            f"`{shlex.join(command)}` cannot be run ({error}): correct `kind`, or run where it is"
        ) from error
    if done.returncode:
        said = " ".join((done.stderr or done.stdout).split())
        raise StudyError(f"`{shlex.join(command)}` was refused ({said or done.returncode}): correct the settings")
    return done.stdout.strip()


@contextmanager
def _commands(settings: Settings, folder: Path, file: Path, tell: Told) -> Iterator[None]:
    """Each in a session of its own: Ctrl-C ends this command, which then ends them."""
    needed = {"scheduler_file": file, "processes": settings.processes, "memory": f"{settings.memory_gb or 0:g}"}
    words = settings.command
    for name, value in needed.items():
        words = words.replace(f"{{{name}}}", str(value))  # other braces are the shell's
    lines = "\n".join([*settings.setup, words])
    started: list[subprocess.Popen[bytes]] = []
    try:
        for number in range(1, settings.workers + 1):
            with open(folder / f"worker-{number}.log", "wb") as log:
                started.append(subprocess.Popen(["bash", "-c", lines], stdout=log, stderr=log, start_new_session=True))
        tell(f"{settings.workers} workers started; what they print is in {folder}")
        yield
    finally:
        for process in started:
            _end(process)


def _end(process: "subprocess.Popen[bytes]") -> None:
    """With all that it has started."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        with suppress(ProcessLookupError):
            os.killpg(process.pid, number)
        with suppress(subprocess.TimeoutExpired):
            process.wait(PATIENCE)
