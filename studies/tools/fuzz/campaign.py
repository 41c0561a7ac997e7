"""Many trials in several processes; a process that dies costs its trial alone."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from functools import partial

import pandas as pd

from studies.base.processes import run_each
from studies.sweep.local import environment
from studies.tools.fuzz.choices import Choices
from studies.tools.fuzz.outcome import UNEXPLAINED, Attempt, Outcome, tried

CHUNK = 25
"""Trials that a process takes at a time."""


def run_trials(
    trials: Iterable[Choices], jobs: int, done: Callable[[Outcome], object], attempt: Attempt = tried
) -> list[Outcome]:
    """What `attempt` made of every trial, in their order; `done` hears of each."""
    trials = list(trials)
    chunks = [trials[first : first + CHUNK] for first in range(0, len(trials), CHUNK)]
    outcomes: dict[int, Outcome] = {}
    for outcome in _each(chunks, jobs, attempt):
        outcomes[outcome.trial.number] = outcome
        done(outcome)
    return [outcomes[trial.number] for trial in trials]


def _each(chunks: list[list[Choices]], jobs: int, attempt: Attempt) -> Iterator[Outcome]:
    """A chunk that ends its process is tried again trial by trial."""
    with closing(run_each(chunks, jobs, partial(try_all, attempt), environment=environment())) as ended:
        for chunk, outcomes, cause in ended:
            if cause is None:
                yield from outcomes
            elif len(chunk) == 1:
                yield Outcome(chunk[0], UNEXPLAINED, cause, float("nan"))
            else:
                yield from _each([[trial] for trial in chunk], jobs, attempt)


def try_all(attempt: Attempt, trials: list[Choices]) -> list[Outcome]:
    """In a process: what came of each."""
    return [attempt(trial) for trial in trials]


def table_of(outcomes: Iterable[Outcome]) -> pd.DataFrame:
    """A row for each trial."""
    return pd.DataFrame([outcome.row for outcome in outcomes])


def counts(table: pd.DataFrame, by: str = "method") -> pd.DataFrame:
    """How many trials ended how: a row for each method, or value of `by`, a column for each status, and of all."""
    tally = pd.DataFrame(pd.crosstab(table[by], table["status"], margins=True, margins_name="all"))
    first = [name for name in ("ok", "refused") if name in tally]
    return tally.reindex(columns=[*first, *sorted(set(tally) - {*first, "all"}), "all"])
