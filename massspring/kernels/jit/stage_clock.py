"""A clock inside the frame loop that times each stage of a step. If it is off, a stage costs one test of a flag."""

from time import perf_counter_ns
from typing import NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload

from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import njit_exposed

STAGES = (
    "springs and prediction",
    "attachments",
    "volume",
    "contact search",
    "multiplier",
    "contact revision",
    "thin probes",
    "integration",
)
"""Stages of a step. If implicit_volume keeps one volume, "springs and prediction" includes the gradient of the
volume."""
SPRINGS, HELD, VOLUME, SEARCH, MULTIPLIER, REVISION, PROBES, INTEGRATION, BETWEEN_FRAMES = range(len(STAGES) + 1)
MONOTONIC = 1
"""The clock's number in POSIX systems (Linux)."""


@by_address
class StageTimes(NamedTuple):
    """Where the time of a frame goes."""

    spent: np.ndarray
    """Time in each stage and outside [ns], (stages + 1,) int64."""
    last: np.ndarray
    """When the last stage ended [ns], (1,) int64."""
    ended: np.ndarray
    """How often each ended, (stages + 1,) int64."""
    on: np.ndarray
    """Whether the clock is on, (1,) bool."""


def new_stage_times(on: bool = True) -> StageTimes:
    """Stage times at zero."""
    spent, last, ended = (np.zeros(size, dtype=np.int64) for size in (len(STAGES) + 1, 1, len(STAGES) + 1))
    return StageTimes(spent, last, ended, np.array([on]))


UNTIMED = new_stage_times(on=False)
"""Stage times of frames that are not timed."""


@intrinsic
def _clock(typingctx):
    """`clock_gettime`, by its name in the process, so that compiled code can be kept on disk; [ns]."""

    def generate(context, builder, signature, arguments):
        i32, i64 = ir.IntType(32), ir.IntType(64)
        time = cgutils.alloca_once(builder, ir.ArrayType(i64, 2))
        kind = ir.FunctionType(i32, [i32, time.type])
        function = cgutils.get_or_insert_function(builder.module, kind, "clock_gettime")
        builder.call(function, [i32(MONOTONIC), time])
        whole = builder.load(cgutils.gep_inbounds(builder, time, 0, 0))
        rest = builder.load(cgutils.gep_inbounds(builder, time, 0, 1))
        return builder.add(builder.mul(whole, i64(1_000_000_000)), rest)

    return types.int64(), generate


def now() -> int:
    """Time of a clock that never goes back [ns]."""
    return perf_counter_ns()


@overload(now)
def _compiled_now():
    return lambda: _clock()  # pyright: ignore[reportCallIssue]


@njit_exposed
def end_stage(times, stage):
    """Adds the time since the last stage ended to `stage`, if the clock is on."""
    if times.on[0]:
        time = now()
        times.spent[stage] += time - times.last[0]
        times.ended[stage] += 1
        times.last[0] = time
