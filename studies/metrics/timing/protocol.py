"""The timing protocol (docs/theory.md, Judging): one pinned core, one thread, warm-up outside, repeats interleaved."""

import gc
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import numba
import numpy as np
from numba.core import config
from threadpoolctl import threadpool_limits

from studies.base.collection import uncollected
from studies.base.errors import StudyError
from studies.metrics.timing.statistics import DEADLINES_MS, Ratio, kernel_ns, missed, percentiles, ratio_with_spread
from studies.store.record import Field, new_fields
from studies.store.schema import TIMING_FIELDS

__all__ = ["DEADLINES_MS", "FrameTiming", "Ratio", "interleave", "kernel_ns", "missed", "percentiles"]
__all__ += ["pinned", "ratio_with_spread"]


@dataclass(frozen=True, eq=False)
class FrameTiming:
    """Frame times of one case on one machine, and under which conditions they were taken.

    frame_ns: time of each frame [ns], shape (repeat, F)
    core: the core this process was pinned to, None where the system cannot pin
    threads: threads that compiled code was allowed
    stage_ns: time of each stage in each frame [ns], shape (stage, F); stages: their names
    """

    frame_ns: np.ndarray
    core: int | None = None
    threads: int = 1
    stage_ns: np.ndarray | None = None
    stages: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _checked(self.frame_ns)
        if (0 if self.stage_ns is None else len(self.stage_ns)) != len(self.stages):
            raise StudyError(f"stage times need one name per row, not {len(self.stages)} names")

    def attributes(self) -> dict[str, int | None]:
        return {"core": self.core, "threads": self.threads, "repeats": len(self.frame_ns)}

    def fields(self) -> dict[str, Field]:
        values = {"frame_ns": self.frame_ns}
        if self.stage_ns is not None:
            values |= {"stage_ns": self.stage_ns, "stages": np.array(self.stages)}
        return new_fields(TIMING_FIELDS, values)


@contextmanager
def pinned(threads: int = 1) -> Iterator[int | None]:
    """Inside, all threads of this process are pinned to `threads` cores, the last allowed ones, since the first handles
    interrupts; compiled code uses as many threads, linear algebra one. Yields the number of the last core, or None if
    the system cannot pin. Raises StudyError if the process may use fewer cores.

    Idle threads of a linear algebra library keep a core busy for 0.1 s: on the same core a kernel seemed to take 2.5
    times as long.
    """
    cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else list(range(os.cpu_count() or 1))
    if threads > min(len(cores), config.NUMBA_NUM_THREADS):  # pyright: ignore[reportAttributeAccessIssue]
        raise StudyError(f"{threads} threads need as many cores; this process may use {len(cores)}")
    before_threads = numba.get_num_threads()
    numba.set_num_threads(threads)
    try:
        with threadpool_limits(limits=1):
            if not hasattr(os, "sched_setaffinity"):
                yield None
                return
            _keep_on(set(cores[-threads:]))
            try:
                yield cores[-1]
            finally:
                _keep_on(set(cores))
    finally:
        numba.set_num_threads(before_threads)


def _keep_on(cores: set[int]) -> None:
    # The call without a thread id pins only the calling thread; threads of the linear algebra libraries already exist.
    tasks = os.listdir("/proc/self/task") if os.path.isdir("/proc/self/task") else ["0"]
    for task in tasks:
        try:
            os.sched_setaffinity(int(task), cores)
        except ProcessLookupError:  # that thread has just ended
            continue


def interleave(
    contestants: Mapping[str, Callable[[], np.ndarray]], repeats: int, warmups: int = 1
) -> dict[str, np.ndarray]:
    """Calls every contestant `repeats` times, in turns, and stacks what they return: name -> (repeats, F) [ns].

    A contestant measures itself and returns its frame times [ns], shape (F,). A slow phase of the machine affects all
    of them; each round starts with a different one. The garbage collector is off inside a round. The results of the
    first `warmups` rounds (compilation, caches) are discarded. Raises StudyError if nothing would be measured, or if a
    contestant returns a different number of frames than before.
    """
    names = list(contestants)
    if not names or repeats < 1 or warmups < 0:
        raise StudyError(f"timing needs a contestant and at least one repeat, not {len(names)} and {repeats}")
    times: dict[str, list[np.ndarray]] = {name: [] for name in names}
    for turn in range(-warmups, repeats):
        first = turn % len(names)
        gc.collect()
        with uncollected():
            for name in names[first:] + names[:first]:
                measured = np.asarray(contestants[name]())
                if turn >= 0:
                    times[name].append(measured)
    return {name: _stacked(name, rows) for name, rows in times.items()}


def _stacked(name: str, rows: list[np.ndarray]) -> np.ndarray:
    shapes = {row.shape for row in rows}
    if len(shapes) > 1 or rows[0].ndim != 1:
        raise StudyError(f"{name!r} must return the same number of frame times in each repeat, not {sorted(shapes)}")
    return _checked(np.stack(rows))


def _checked(frame_ns: np.ndarray) -> np.ndarray:
    frame_ns = np.asarray(frame_ns)
    if frame_ns.ndim != 2 or frame_ns.size == 0 or not np.all(frame_ns > 0):
        raise StudyError(f"frame times must be positive, shape (repeat, frame), not of shape {frame_ns.shape}")
    return frame_ns
