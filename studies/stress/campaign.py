"""Many trials in several processes; a process that dies costs its trial alone."""

import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool

import pandas as pd

from studies.base.interrupts import die_quietly
from studies.stress.outcome import UNEXPLAINED, Outcome, tried
from studies.stress.trial import Trial, draw

CHUNK = 25
"""Trials that a process takes at a time."""
ONE_THREAD = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")


def run_trials(trials: Iterable[Trial], jobs: int, done: Callable[[Outcome], object]) -> list[Outcome]:
    """What came of every trial, in their order; `done` hears of each."""
    trials = list(trials)
    chunks = [trials[first : first + CHUNK] for first in range(0, len(trials), CHUNK)]
    found: dict[int, Outcome] = {}
    for outcome in _in_pool(chunks, jobs):
        found[outcome.trial.number] = outcome
        done(outcome)
    # What a dead process left is tried once more, each trial in a process of its own.
    for trial in trials:
        if trial.number not in found:
            found[trial.number] = _alone(trial)
            done(found[trial.number])
    return [found[trial.number] for trial in trials]


def _in_pool(chunks: list[list[Trial]], jobs: int) -> Iterator[Outcome]:
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))  # read by the libraries when a worker loads them
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=die_quietly)  # not outliving this process
    try:
        for future in as_completed([pool.submit(try_all, chunk) for chunk in chunks]):
            if not isinstance(future.exception(), BrokenProcessPool):
                yield from future.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _alone(trial: Trial) -> Outcome:
    return next(_in_pool([[trial]], 1), Outcome(trial, UNEXPLAINED, "its process died", float("nan")))


def try_all(trials: list[Trial]) -> list[Outcome]:
    """What came of each, in one process."""
    return [tried(trial) for trial in trials]


def drawn(seed: int, cases: int) -> list[Trial]:
    """Trials 0 to cases - 1 of a seed."""
    return [draw(seed, number) for number in range(cases)]


def table_of(outcomes: Iterable[Outcome]) -> pd.DataFrame:
    """A row for each trial."""
    return pd.DataFrame([outcome.row for outcome in outcomes])


def counts(table: pd.DataFrame) -> pd.DataFrame:
    """How many trials ended how: a row for each method, a column for each status, and of all."""
    found = pd.DataFrame(pd.crosstab(table["method"], table["status"], margins=True, margins_name="all"))
    first = [name for name in ("ok", "refused") if name in found]
    return found.reindex(columns=[*first, *sorted(set(found) - {*first, "all"}), "all"])
