"""Several threads for one frame: the calling thread runs the frame, the others take parts of its longest loops.

Every number is computed by the same instructions as with one thread, and each slice is summed separately, so results
are equal to the last bit. Threads wait by spinning, since a step is too short for sleep.
"""

import os
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload

from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import njit_exposed, njit_inlined

LINE = 8
"""Numbers per cache line: counters in the same line would slow each other down."""
ROUND, DONE, JOB, STEP, READY = (LINE * line for line in range(5))
JOB_END, JOB_SPRINGS, JOB_SPRINGS_AND_VOLUME, JOB_SEARCH, JOB_MOVE = range(5)
"""Jobs of the other threads; JOB_END ends the frame."""
PATIENCE = 20_000
"""Looks at a counter before the thread offers its core to others: 5 to 10 µs."""


@by_address
class ThreadTeam(NamedTuple):
    """How T threads share the work: each takes a range of slices and a range of nodes.

    The ranges depend on T, the sums do not: each slice is summed separately, and slices are added in order."""

    signal: np.ndarray
    """Round number, parts done, job, step, whether all is compiled; one line of the cache each, int64."""
    factor: np.ndarray
    """Of the push in this job, (1,) float64."""
    slices: np.ndarray
    """First slice of each thread, (T + 1,) int64."""
    nodes: np.ndarray
    """First node of each thread, (T + 1,) int64."""


def look(signal: np.ndarray, at: int) -> int:
    """signal[at], with acquire ordering: everything written before it is visible."""
    return int(signal[at])


def raise_by_one(signal: np.ndarray, at: int) -> None:
    """signal[at] += 1, with release ordering: other threads see earlier writes first."""
    signal[at] += 1


def offer_core() -> None:
    """Lets another thread of this core run."""
    if hasattr(os, "sched_yield"):
        os.sched_yield()


def _pointer(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    array = context.make_array(signature.args[0])(context, builder, args[0])
    return builder.gep(array.data, [args[1]])


@intrinsic
def _look(typingctx: Any, signal: Any, at: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load_atomic(_pointer(context, builder, signature, args), "acquire", 8)

    return types.int64(signal, types.intp), generate


@intrinsic
def _raise_by_one(typingctx: Any, signal: Any, at: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        builder.atomic_rmw(
            "add", _pointer(context, builder, signature, args), ir.Constant(ir.IntType(64), 1), "acq_rel"
        )
        return context.get_dummy_value()

    return types.void(signal, types.intp), generate


@intrinsic
def _offer_core(typingctx: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(ir.IntType(32), [])
        builder.call(cgutils.get_or_insert_function(builder.module, kind, "sched_yield"), [])
        return context.get_dummy_value()

    return types.void(), generate


@overload(look)
def _compiled_look(signal, at):
    return lambda signal, at: _look(signal, at)  # pyright: ignore[reportCallIssue]


@overload(raise_by_one)
def _compiled_raise(signal, at):
    return lambda signal, at: _raise_by_one(signal, at)  # pyright: ignore[reportCallIssue]


@overload(offer_core)
def _compiled_offer():
    return lambda: _offer_core()  # pyright: ignore[reportCallIssue]


@njit_inlined
def wait_until_other_than(signal, at, value):
    """Waits until signal[at] differs from `value`; returns it."""
    looks = 0
    now = look(signal, at)
    while now == value:
        looks += 1
        if looks > PATIENCE:
            offer_core()
        now = look(signal, at)
    return now


@njit_exposed
def fork(team, job, step, factor):
    """Gives every other thread its part of a job."""
    team.signal[JOB], team.signal[STEP], team.signal[DONE] = job, step, 0
    team.factor[0] = factor
    raise_by_one(team.signal, ROUND)


@njit_exposed
def join(team):
    """Waits until all parts of the job are done."""
    others = team.nodes.shape[0] - 2
    while True:
        done = look(team.signal, DONE)
        if done == others:
            return
        wait_until_other_than(team.signal, DONE, done)


def team_of(threads: int, rows: np.ndarray, nodes: int, block: int) -> ThreadTeam:
    """T threads for slices that begin at `rows` (S + 1,) and for n nodes, with shares as equal as whole slices and
    blocks allow."""
    share = np.arange(threads + 1) / threads
    slices = np.searchsorted(rows, share * rows[-1])
    borders = np.round(share * nodes / block).astype(np.int64) * block
    borders[-1] = nodes
    return ThreadTeam(
        np.zeros(5 * LINE, dtype=np.int64), np.zeros(1), slices.astype(np.int64), np.minimum(borders, nodes)
    )
