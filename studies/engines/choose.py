"""The engine that `--on` names."""

from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from pathlib import Path

from studies.base.errors import StudyError
from studies.sweep.engine import Engine
from studies.sweep.pool import Pool

LOCAL = "local"
NEEDED = "needs the package distributed, which is not installed: pip install 'distributed>=2025.1'"
NO_WORKER_SECONDS = 60.0
"""That a cluster which is there may be without a worker."""
WORDS = "local:N, an address as tcp://HOST:8786, or a FILE.yaml"


def engine_for(on: str, jobs: int, portable: bool, root: Path, tell: Callable[[str], object]) -> Engine:
    """The engine of `organbench run --on`.

    on: one of WORDS, "" for `jobs` processes of this machine; root: the results folder; tell: hears of jobs.
    Raises StudyError for other words, and where the extra `cluster` is not installed.
    """
    if not on or on.split(":")[0] == LOCAL:
        return Pool(_count(on, jobs), portable)
    if "://" not in on and not on.endswith((".yaml", ".yml")):
        raise StudyError(f"--on {on!r} is no engine; give {WORDS}")
    try:
        from studies.engines.cluster import Cluster
        from studies.engines.jobs import scheduler_with_jobs
        from studies.engines.settings import read_settings
    except ImportError as error:
        if error.name not in ("distributed", "dask", "yaml"):
            raise
        raise StudyError(f"--on {on} {NEEDED}") from error
    if "://" in on:
        return Cluster(lambda: nullcontext(on), NO_WORKER_SECONDS, portable)
    settings = read_settings(Path(on))
    begun = partial(scheduler_with_jobs, settings, root, tell)
    return Cluster(
        begun, 3600 * settings.wait_hours, portable or settings.portable, settings.workers * settings.processes
    )


def _count(on: str, jobs: int) -> int:
    _, colon, number = on.partition(":")
    if not colon:
        return jobs
    if not (number.isascii() and number.isdigit() and int(number) > 0):
        raise StudyError(f"--on {on!r}: give the number of processes, as local:4")
    return int(number)
