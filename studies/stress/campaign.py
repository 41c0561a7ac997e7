"""Many trials in several processes; a process that dies costs its trial alone."""

import pickle
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd

from studies.base.interrupts import die_quietly
from studies.stress.choices import Choices
from studies.stress.outcome import UNEXPLAINED, Attempt, Outcome, tried
from studies.sweep.pool import environment_of_workers
from studies.sweep.workers import done_or_dead

CHUNK = 25
"""Trials that a process takes at a time."""


def run_trials(
    trials: Iterable[Choices], jobs: int, done: Callable[[Outcome], object], attempt: Attempt = tried
) -> list[Outcome]:
    """What `attempt` made of every trial, in their order; `done` hears of each."""
    trials = list(trials)
    chunks = [trials[first : first + CHUNK] for first in range(0, len(trials), CHUNK)]
    found: dict[int, Outcome] = {}
    with TemporaryDirectory() as folder, environment_of_workers():
        for outcome in _each(chunks, jobs, Path(folder), attempt):
            found[outcome.trial.number] = outcome
            done(outcome)
    return [found[trial.number] for trial in trials]


def _each(chunks: list[list[Choices]], jobs: int, folder: Path, attempt: Attempt) -> Iterator[Outcome]:
    """A chunk that ends its process is tried again trial by trial."""
    with closing(done_or_dead(chunks, jobs, partial(try_all, folder, attempt), die_quietly)) as ended:
        for chunk, cause in ended:
            if cause is None:
                yield from pickle.loads(_file(folder, chunk).read_bytes())
            elif len(chunk) == 1:
                yield Outcome(chunk[0], UNEXPLAINED, cause, float("nan"))
            else:
                yield from _each([[trial] for trial in chunk], jobs, folder, attempt)


def try_all(folder: Path, attempt: Attempt, trials: list[Choices]) -> None:
    """In a process: what came of each, left in `folder`."""
    _file(folder, trials).write_bytes(pickle.dumps([attempt(trial) for trial in trials]))


def _file(folder: Path, trials: list[Choices]) -> Path:
    return folder / f"{trials[0].number}-{len(trials)}"


def table_of(outcomes: Iterable[Outcome]) -> pd.DataFrame:
    """A row for each trial."""
    return pd.DataFrame([outcome.row for outcome in outcomes])


def counts(table: pd.DataFrame, by: str = "method") -> pd.DataFrame:
    """How many trials ended how: a row for each method, or value of `by`, a column for each status, and of all."""
    found = pd.DataFrame(pd.crosstab(table[by], table["status"], margins=True, margins_name="all"))
    first = [name for name in ("ok", "refused") if name in found]
    return found.reindex(columns=[*first, *sorted(set(found) - {*first, "all"}), "all"])
