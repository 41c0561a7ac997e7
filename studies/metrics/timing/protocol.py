"""The timing protocol (docs/theory.md, section 7): one pinned core and thread, warm-up outside, repeats interleaved."""

import gc
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time

import numba
import numpy as np
from numba.core import config
from threadpoolctl import threadpool_limits

from studies.base.collection import uncollected
from studies.base.errors import StudyError
from studies.metrics.timing.statistics import (
    DEADLINES_MS,
    DISTURBED,
    Ratio,
    disturbance,
    kernel_ns,
    missed,
    percentiles,
    ratio_with_spread,
)
from studies.store.machine import this_machine
from studies.store.record import Field, new_fields
from studies.store.schema import TIMING_FIELDS

__all__ = ["DEADLINES_MS", "FrameTiming", "Ratio", "interleave", "kernel_ns", "missed", "percentiles"]
__all__ += ["pinned", "ratio_with_spread"]
STAT = Path("/proc/stat")
BUSY, IDLE = [0, 1, 2, 5, 6, 7], [3, 4]
"""Columns of its first line: user, nice, system, interrupts, software interrupts, stolen by other guests; idle, waiting
for a disk (proc(5))."""
COUNTED = 1.0
"""Least processor time [s] in which load is told to a few hundredths: it is counted in hundredths of a second."""


@dataclass(frozen=True, eq=False)
class FrameTiming:
    """Frame times of one case on one machine, and under which conditions they were taken.

    frame_ns: wall time of each frame [ns], shape (repeat, F)
    core: the core this process was pinned to, None where the system cannot pin
    threads: threads that compiled code was allowed
    stage_ns: time of each stage in each frame [ns], shape (stage, F); stages: their names
    cpu_ns: processor time of the thread in each frame [ns], as frame_ns; None where it was not measured
    others: share of the machine's processors that other processes took meanwhile, 0 to 1; None where it is not known
    processor: its name
    """

    frame_ns: np.ndarray
    core: int | None = None
    threads: int = 1
    stage_ns: np.ndarray | None = None
    stages: tuple[str, ...] = ()
    cpu_ns: np.ndarray | None = None
    others: float | None = None
    processor: str = ""

    def __post_init__(self) -> None:
        _checked(self.frame_ns)
        cpu = self.frame_ns if self.cpu_ns is None else self.cpu_ns
        if cpu.shape != self.frame_ns.shape or not np.all(cpu >= 0):
            raise StudyError(f"processor times must not be negative, and of shape {self.frame_ns.shape}")
        if (0 if self.stage_ns is None else len(self.stage_ns)) != len(self.stages):
            raise StudyError(f"stage times need one name per row, not {len(self.stages)} names")

    @property
    def disturbed(self) -> str:
        """Why these are not the times of the program alone; empty where nothing says so."""
        return disturbance(self.frame_ns, self.cpu_ns, self.others)

    def repeats(self) -> "list[FrameTiming]":
        """Each repeat alone."""
        cpu = [None] * len(self.frame_ns) if self.cpu_ns is None else self.cpu_ns[:, None]
        return [replace(self, frame_ns=wall, cpu_ns=own) for wall, own in zip(self.frame_ns[:, None], cpu, strict=True)]

    def attributes(self) -> dict[str, int | float | str | None]:
        conditions = {"core": self.core, "threads": self.threads, "repeats": len(self.frame_ns)}
        return conditions | {"others": self.others, "processor": self.processor, "disturbed": self.disturbed}

    def fields(self) -> dict[str, Field]:
        values = {"frame_ns": self.frame_ns} | ({} if self.cpu_ns is None else {"cpu_ns": self.cpu_ns})
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


def processor_seconds() -> np.ndarray | None:
    """Processor time since some moment [s]: of all processors, of those while busy, and of this process, (3,); None
    where the system does not count it."""
    if not STAT.is_file():
        return None
    ticks = np.array(STAT.read_text().split("\n", 1)[0].split()[1:], float)
    busy = ticks[BUSY].sum() / os.sysconf("SC_CLK_TCK")
    return np.array([busy + ticks[IDLE].sum() / os.sysconf("SC_CLK_TCK"), busy, process_time()])


def share_of_others(before: np.ndarray | None, after: np.ndarray | None) -> float | None:
    """Share of the processors that other processes took between two `processor_seconds`; None where that is not known:
    too short to tell, or the counters do not hold what this process used itself."""
    if before is None or after is None:
        return None
    whole, busy, own = after - before
    share = (busy - own) / whole if whole >= COUNTED else -np.inf
    return max(float(share), 0.0) if share > -DISTURBED else None


def interleave(
    contestants: Mapping[str, Callable[[], np.ndarray]], repeats: int, warmups: int = 1, core: int | None = None
) -> dict[str, FrameTiming]:
    """Calls every contestant `repeats` times, in turns: name -> what it took. core: that of `pinned`.

    A contestant measures itself and returns wall and processor time of its frames [ns], shape (2, F). A slow phase of
    the machine affects all of them; each round starts with a different one. The garbage collector is off inside a
    round. The results of the first `warmups` rounds (compilation, caches) are discarded. Raises StudyError if nothing
    would be measured, or if a contestant returns a different number of frames than before.
    """
    names = list(contestants)
    if not names or repeats < 1 or warmups < 0:
        raise StudyError(f"timing needs a contestant and at least one repeat, not {len(names)} and {repeats}")
    times: dict[str, list[np.ndarray]] = {name: [] for name in names}
    before = None
    for turn in range(-warmups, repeats):
        before = processor_seconds() if turn == 0 else before
        first = turn % len(names)
        gc.collect()
        with uncollected():
            for name in names[first:] + names[:first]:
                measured = np.asarray(contestants[name]())
                if turn >= 0:
                    times[name].append(measured)
    others, timings = share_of_others(before, processor_seconds()), {}
    for name, rows in times.items():
        shapes = {row.shape for row in rows}
        if len(shapes) > 1 or rows[0].ndim != 2:
            raise StudyError(
                f"{name!r} must return the same number of frame times in each repeat, not {sorted(shapes)}"
            )
        frame_ns, cpu_ns = np.stack(rows, axis=1)
        timings[name] = FrameTiming(frame_ns, core, cpu_ns=cpu_ns, others=others, processor=this_machine().cpu)
    return timings


def _checked(frame_ns: np.ndarray) -> None:
    frame_ns = np.asarray(frame_ns)
    if frame_ns.ndim != 2 or frame_ns.size == 0 or not np.all(frame_ns > 0):
        raise StudyError(f"frame times must be positive, shape (repeat, frame), not of shape {frame_ns.shape}")
