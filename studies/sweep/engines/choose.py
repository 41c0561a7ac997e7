"""The executor that `--on` names."""

from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from pathlib import Path

from studies.base.errors import StudyError
from studies.base.install import pip_install
from studies.sweep.executor import Executor
from studies.sweep.local import Local

LOCAL = "local"
EXTRA = ("distributed", "dask", "dask_jobqueue", "yaml", "psutil")
"""What the extra `cluster` installs."""
NEEDED = f"needs the extra `cluster`, which is not installed: {pip_install('organbench[cluster]')}"
NO_WORKER_SECONDS = 60.0
"""Time that a running cluster may be without a worker."""
WORDS = "local:N, an address as tcp://HOST:8786, or a FILE.yaml"


def executor_for(on: str, jobs: int, root: Path, tell: Callable[[str], object]) -> Executor:
    """The executor of `organbench run --on`.

    on: one of WORDS, "" for `jobs` processes of this machine; root: the results folder; tell: reports on workers.
    Raises StudyError for other words, and where the extra `cluster` is not installed.
    """
    if not on or on.split(":")[0] == LOCAL:
        return Local(_count(on, jobs))
    if "://" not in on and not on.endswith((".yaml", ".yml")):
        raise StudyError(f"--on {on!r} is not known; give {WORDS}")
    try:
        from studies.sweep.engines.cluster import Cluster
        from studies.sweep.engines.queue import read_settings, scheduler_with_workers
    except ImportError as error:
        if error.name not in EXTRA:
            raise
        raise StudyError(f"--on {on} {NEEDED}") from error
    if "://" in on:
        return Cluster(lambda: nullcontext(on), NO_WORKER_SECONDS)
    settings = read_settings(Path(on))
    begun = partial(scheduler_with_workers, settings, root, tell)
    return Cluster(begun, 3600 * settings.wait_hours, settings.workers * settings.processes)


def _count(on: str, jobs: int) -> int:
    _, colon, number = on.partition(":")
    if not colon:
        return jobs
    if not (number.isascii() and number.isdigit() and int(number) > 0):
        raise StudyError(f"--on {on!r}: give the number of processes, as local:4")
    return int(number)
