"""Frame by frame: moves the obstacles, advances the method, records. The only Python in the loop is once per frame."""

import math
from collections.abc import Callable, Iterable
from time import perf_counter_ns, thread_time_ns

import numpy as np

from massspring.body.body import Body
from massspring.layout.state import State
from massspring.run.checks import check_loads, check_probes, check_slip
from massspring.run.energy import EnergyAccount
from massspring.run.history import History, Recorder, passage
from massspring.run.loaded_steps import LoadedSteps
from massspring.run.setup import Setup
from massspring.run.stages import stages_of

ESCAPED = 20.0
"""Distance of a node from its rest position, in body sizes, beyond which the run counts as diverged; no obstacle pushes
so far."""


def check_state(state: State, x: np.ndarray, body: Body) -> str | None:
    """Why the run cannot go on from a state with positions `x` (n, 3) [m], or None: values that are not finite, or
    nodes that have left."""
    far = float(np.abs(x - body.rest).max())
    if not np.isfinite(far):
        return "positions are no longer finite"
    if not np.isfinite(state.lam).all():
        return "pressures are no longer finite"
    return None if far < ESCAPED * body.size else f"a node has moved {far:.3g} m from rest"


def simulate(
    setup: Setup,
    snapshots: Iterable[int] = (),
    on_frame: Callable[[int], object] | None = None,
    time_limit: float = math.inf,
) -> History:
    """Runs all frames, or up to the first that diverges, and returns the history.

    `snapshots`: numbers (1 … F) of the frames after which positions are kept. `on_frame(number)` is called after each.
    A run that takes more than `time_limit` [s] of this thread's processor time ends early. Frame times are those of the
    steps and of finding how many they are.
    """
    keep = frozenset(snapshots)
    now, *later = stages = stages_of(setup)
    recorder = Recorder(stages[-1].setup.body, setup.clock, setup.obstacles, len(setup.attachments), keep)
    recorder.volume_target[:] = stages[-1].setup.volume_targets(recorder.t)
    state = now.start
    begun = thread_time_ns()
    loaded, account = LoadedSteps(now.setup, state), EnergyAccount(now.setup, state)
    for frame in range(setup.clock.frames):
        if later and frame == later[0].frame:
            begin, before, was = perf_counter_ns(), state, now.setup.body
            now = later.pop(0).entered(state)
            state = now.start
            loaded, account = LoadedSteps(now.setup, state), account.entered(now.setup, state)
            recorder.passages.append(passage(before, was, state, now.setup.body, perf_counter_ns() - begin))
        state = now.let_in(state, frame)
        boundary = now.boundary(frame, loaded.steps)
        reason = check_loads(boundary)
        if reason is not None:
            return recorder.stopped(frame, "diverged", reason)
        own, begin = thread_time_ns(), perf_counter_ns()
        state, steps = loaded.advanced(now, state, frame, boundary)
        taken = perf_counter_ns() - begin, thread_time_ns() - own
        x = state.x.astype(np.float64, copy=False)
        reason = check_state(state, x, now.setup.body)
        if reason is not None:
            return recorder.stopped(frame, "diverged", reason)
        reason = check_probes(state, setup.obstacles)
        if reason is not None:
            return recorder.stopped(frame, "blocked", reason)
        measured = now.setup.body.measured(x)
        account.add(state, measured, steps)
        recorder.record(frame, state, measured, steps, taken, now.last)
        recorder.record_energy(frame, account)
        if setup.events:
            recorder.record_targets(frame, now.targets_after(frame), now.last)
        if on_frame is not None:
            on_frame(frame + 1)
        if thread_time_ns() - begun > 1e9 * time_limit and frame + 1 < setup.clock.frames:
            return recorder.stopped(frame + 1, "timed-out", f"the time limit of {time_limit:g} s was reached")
    if state.pairs is not None:
        check_slip(int(state.pairs.lost[0]), len(state.pairs.node))
    return recorder.finished()
