"""The other threads of a frame: forked when it begins, shut down when it ends (kernels.jit.thread_team)."""

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from functools import cache

import numpy as np

from massspring.kernels.fused.chunk import TILE
from massspring.kernels.jit.blocks import BLOCK
from massspring.kernels.jit.thread_team import READY, ROUND, team_of
from massspring.kernels.step.frame import Frame
from massspring.kernels.step.thread_jobs import shutdown, worker
from massspring.layout.sell_chunks import aligned
from massspring.layout.state import State


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def shared(state: State, threads: int) -> State:
    """`state` prepared for two or more `threads`, each with separate scratch memory."""
    team = team_of(threads, state.model.slices.start, len(state.nodes.x), BLOCK)
    work = state.work._replace(tile=aligned((threads, TILE), state.work.tile.dtype))
    return replace(state, work=work, team=team)


@contextmanager
def team_at_work(frame: Frame, direction: np.ndarray) -> Iterator[None]:
    """Inside, the other threads of `frame.team` wait for their parts; without a team nothing happens.

    `direction` (n, 3): of the pushes of the frame.
    """
    team = frame.team
    if team is None:
        yield
        return
    others = range(1, len(team.nodes) - 1)
    if not team.signal[READY]:
        # The first call compiles here: a thread that has to compile, or fails to, would block the frame.
        shutdown(team)
        worker(frame, team, direction, 1)
        team.signal[READY] = 1
    team.signal[ROUND] = 0
    parts = [_pool(os.getpid(), len(others)).submit(worker, frame, team, direction, rank) for rank in others]
    try:
        yield
    finally:
        shutdown(team)
        for part in parts:
            part.result()


@cache
def _pool(process: int, others: int) -> ThreadPoolExecutor:
    """Threads live as long as the process. A forked process has none of its parent's, hence the process id as key."""
    return ThreadPoolExecutor(others, thread_name_prefix="massspring")
