"""`organbench worker`: a worker of a Dask cluster."""

import os
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from studies.base.errors import StudyError
from studies.sweep.engines.choose import NEEDED
from studies.sweep.engines.tls import LONELY_SECONDS, NO_PAGES, words_of


def worker(
    scheduler: Annotated[str, typer.Argument(help="address of the scheduler, such as tcp://HOST:8786")] = "",
    file: Annotated[Path | None, typer.Option("--scheduler-file", help="a file with that address")] = None,
    processes: Annotated[int, typer.Option(min=1, help="tasks at a time")] = 1,
    memory: Annotated[float, typer.Option(min=0, help="memory limit in GB for all tasks; 0: the machine's share")] = 0,
    name: Annotated[str, typer.Option(help="name of this worker in messages")] = "",
) -> None:
    """Run tasks for `organbench run --on` until stopped.

    The same as `dask worker`, with one process for each task.
    """
    if bool(scheduler) == (file is not None):
        raise StudyError("give either the address of a scheduler or a --scheduler-file")
    if find_spec("distributed") is None:
        raise StudyError(f"a worker {NEEDED}")
    where = [scheduler] if file is None else ["--scheduler-file", str(file), *words_of(file.absolute().parent)]
    words = [*where, "--nthreads", str(processes), "--nworkers", "1", *NO_PAGES]
    words += ["--memory-limit", f"{memory:g}GB" if memory else "auto", "--death-timeout", str(LONELY_SECONDS)]
    words += ["--name", name] if name else []
    os.execv(sys.executable, [sys.executable, "-m", "distributed.cli.dask_worker", *words])
