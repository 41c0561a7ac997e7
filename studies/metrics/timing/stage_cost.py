"""Cost of a step of a scene by stages, stages that the scene does not need, and the saving by skipping them.

The stages are those that the frame loop of the method times (massspring.kernels.jit.stage_clock): real steps of the
real run, on one pinned core. The same frames are also run without timing of stages, in turn; their time beyond the sum
of the stages is the rest.
"""

from dataclasses import replace
from functools import partial
from time import perf_counter_ns, thread_time_ns

import numpy as np
import pandas as pd

from massspring import MassSpringError, Setup, State
from massspring.kernels.jit.decorators import compiled
from massspring.kernels.jit.stage_clock import (
    BETWEEN_FRAMES,
    INTEGRATION,
    STAGES,
    UNTIMED,
    StageTimes,
    end_stage,
    new_stage_times,
)
from massspring.run.energy import EnergyAccount
from massspring.run.history import Recorder
from massspring.run.loaded_steps import LoadedSteps
from massspring.run.simulation import check_state
from massspring.run.stages import Stage, stages_of
from studies.metrics.timing.protocol import pinned
from studies.metrics.timing.skips import SKIPS
from studies.runs.case import Case
from studies.runs.prepare import prepare

FRAMES, REPEATS = 100, 5
BUDGET = 4.0
"""Time for the repeats [s]: a turn that would exceed it is left out, except the first."""
EXPENSIVE = 5.0
"""Factor on the time of the original run beyond which a run with an added stage is made only once: the difference is
far above noise."""
ENDS = 100_000
"""Number of stage ends in a row from which the cost of one is measured."""
CALL = "call of the frame"
"""Row for the call from Python into compiled code and back, with the copies that leave the old state unchanged; where
the load tells how many steps a frame needs, also for finding that."""
ROWS = (*STAGES, CALL)
PATHS, RECORDING = "paths of obstacles and targets", "recording"
PLAIN, TIMED = "as it is", "with marks"
STAGE, SKIPPED, FRAME = "stage", "skipped", "per frame"


TimedFrames = tuple[np.ndarray, np.ndarray, State]
"""Wall and processor time of each frame [ns], (2, F); times of its ROWS without the cost of timing [ns], (rows, F); the
last state."""


def run_frames(setup: Setup, state: State, times: StageTimes = UNTIMED, frames: int | None = None) -> TimedFrames:
    """Runs the first `frames` of a set-up, or all, and its events. Raises MassSpringError for a run that diverges."""
    now, *later = stages_of(setup) if setup.events else [Stage(setup, state)]
    state = _with_clock(state, times)
    frames = setup.clock.frames if frames is None else frames
    taken, stage_ns = np.zeros((2, frames)), np.zeros((len(ROWS), frames))
    price = end_stage_ns() if times.on[0] else 0.0
    loaded = LoadedSteps(now.setup, state)
    for frame in range(frames):
        if later and frame == later[0].frame:
            now = later.pop(0).entered(state)
            state = _with_clock(now.start, times)
            loaded = LoadedSteps(now.setup, state)
        state = now.let_in(state, frame)
        boundary = now.boundary(frame, loaded.steps)
        if times.on[0]:
            times.spent[:], times.ended[:] = 0, 0
        own, begin = thread_time_ns(), perf_counter_ns()
        state, _ = loaded.advanced(now, state, frame, boundary)
        taken[:, frame] = perf_counter_ns() - begin, thread_time_ns() - own
        if times.on[0]:
            # The time of a very short stage may be less than the cost of timing it.
            stage_ns[:BETWEEN_FRAMES, frame] = np.maximum(
                times.spent[:BETWEEN_FRAMES] - price * times.ended[:BETWEEN_FRAMES], 0.0
            )
            stage_ns[BETWEEN_FRAMES, frame] = taken[0, frame] - times.spent[:BETWEEN_FRAMES].sum()
        reason = check_state(state, state.x, now.setup.body)
        if reason is not None:
            raise MassSpringError(f"the run broke off while its cost was measured: {reason}; take a smaller dt")
    return taken, stage_ns, state


def _with_clock(state: State, times: StageTimes) -> State:
    return replace(state, diagnostics=state.diagnostics._replace(stage_times=times))


def stage_times(setup: Setup) -> np.ndarray:
    """Time of each of ROWS in each frame [ns], (rows, F); compiled before."""
    run_frames(setup, setup.start(), new_stage_times(), frames=1)
    return run_frames(setup, setup.start(), new_stage_times())[1]


@compiled
def _end_stages(times: StageTimes, count: int):
    for _ in range(count):
        end_stage(times, INTEGRATION)


def end_stage_ns() -> float:
    """Cost of ending a stage [ns]."""
    times = new_stage_times()
    _end_stages(times, 1)
    begin = perf_counter_ns()
    _end_stages(times, ENDS)
    return (perf_counter_ns() - begin) / ENDS


def cost_table(case: Case, frames: int = FRAMES, repeats: int = REPEATS, budget: float = BUDGET) -> pd.DataFrame:
    """Rows of stages, rest and the whole step [µs per step], skipped stages with what they would cost and how much of
    them was skipped, and what Python does once per frame, over as many steps. Times are the shortest of up to `repeats`
    turns, as many as `budget` [s] allows: attrs["turns"] says how many.

    Raises StudyError or MassSpringError for a case that cannot run."""
    setup = prepare(case.replaced(frames=min(frames, case.frames or case.scene.frames))).setup
    skipped = [skip for skip in SKIPS if skip.left_out(setup) and skip.can_be(setup)]
    runs = {PLAIN: partial(run_frames, setup, setup.start()), TIMED: partial(_timed, setup)}
    runs |= {skip.name: partial(run_frames, *skip.included(setup, setup.start())) for skip in skipped}
    with pinned(threads=1):
        turns = _in_turns(runs, repeats, budget)
        outside = _per_frame(setup)
    to_step = 1e-3 / setup.clock.steps
    whole = {
        name: to_step * float(np.min([r[0][0] for r in results], axis=0).mean()) for name, results in turns.items()
    }
    step = whole[PLAIN]
    stages = to_step * _fastest(turns[TIMED]).mean(axis=1)
    rows = [(STAGE, name, cost, "") for name, cost in zip(ROWS, stages, strict=True) if cost > 0]
    rows += [(STAGE, "rest, not attributed", step - float(stages.sum()), ""), (STAGE, "whole step", step, "")]
    end = turns[PLAIN][0][2]
    rows += [(SKIPPED, skip.name, whole[skip.name] - step, skip.remark(setup, end)) for skip in skipped]
    rows += [(FRAME, name, to_step * ns, "") for name, ns in outside.items()]
    table = pd.DataFrame(rows, columns=["kind", "what", "µs per step", "how much"])
    table.attrs["turns"] = len(turns[PLAIN])
    table.insert(3, "share of the step", table["µs per step"] / step)
    return table


def _timed(setup: Setup, frames: int | None = None) -> TimedFrames:
    return run_frames(setup, setup.start(), new_stage_times(), frames)


def _in_turns(runs: dict[str, partial[TimedFrames]], repeats: int, budget: float) -> dict[str, list[TimedFrames]]:
    """Makes every run up to `repeats` times, in turn, after compilation; an EXPENSIVE one only once. Except for the
    first, a turn is not started if it would end after `budget` [s]."""
    for run in runs.values():
        run(frames=1)
    turns: dict[str, list[TimedFrames]] = {name: [] for name in runs}
    shortest = dict.fromkeys(runs, 0.0)
    began, longest = perf_counter_ns(), 0
    for turn in range(repeats):
        start = perf_counter_ns()
        if turn and start - began + longest > 1e9 * budget:
            break
        for name, run in runs.items():
            if shortest[name] > EXPENSIVE * shortest[PLAIN]:
                continue
            turns[name].append(run())
            took = float(turns[name][-1][0][0].sum())
            shortest[name] = min(took, shortest[name]) if turn else took
        longest = perf_counter_ns() - start  # later turns skip expensive runs, so they take no longer
    return turns


def _fastest(timed: list[TimedFrames]) -> np.ndarray:
    """Times of ROWS in the fastest repeat of each frame, (rows, F)."""
    quickest = np.argmin([taken[0] for taken, _, _ in timed], axis=0)
    stages = np.stack([stage_ns for _, stage_ns, _ in timed])
    return stages[quickest, :, np.arange(stages.shape[2])].T


def _per_frame(setup: Setup) -> dict[str, float]:
    """Time of the work once per frame, outside the frame time, with the body after all events: medians [ns]."""
    setup = setup.later[-1] if setup.events else setup
    clock, begun = setup.clock, setup.start()
    recorder = Recorder(setup.body, clock, setup.obstacles, len(setup.attachments), frozenset[int]())
    account, state = EnergyAccount(setup, begun), setup.method.advance(begun, setup.boundary(0))
    times = np.zeros((2, clock.frames))

    def recording(frame: int) -> None:
        measured = setup.body.measured(state.x.astype(np.float64, copy=False))
        account.add(state, measured, clock.steps)
        recorder.record(frame, state, measured, clock.steps, (0, 0))
        recorder.record_energy(frame, account)

    for frame in range(clock.frames):
        for row, work in enumerate([setup.boundary, recording]):
            begin = perf_counter_ns()
            work(frame)
            times[row, frame] = perf_counter_ns() - begin
    return dict(zip((PATHS, RECORDING), map(float, np.median(times, axis=1)), strict=True))
