"""What a step of a scene costs, stage by stage, what the scene does not need, and what leaving that out saves.

The stages are those that the method's own frame loop marks (massspring.kernels.ticks): real steps of the real run, on
one pinned core. The same frames without marks are run in turns; what they take beyond the stages is the rest.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter_ns

import numba
import numpy as np
import pandas as pd

from massspring import ImplicitVolume, MassSpringError, Setup, Sphere, State
from massspring.history import EXTRA, Recorder
from massspring.kernels.probe_layout import COMPARED, IN_CONTACT, LEFT_BEHIND, TESTED
from massspring.kernels.ticks import INTEGRATION, OUTSIDE, STAGES, Ticks, mark, new_ticks
from massspring.methods.rows import volume_rows
from massspring.simulation import trouble
from studies.adapt import prepare
from studies.case import Case
from studies.timing import pinned

FRAMES, REPEATS = 100, 5
MARKS = 100_000
"""Marks in a row, to learn what one costs."""
CALL = "call of the frame"
"""From Python into compiled code and back, with the copies that leave the old state as it was."""
ROWS = (*STAGES, CALL)
FAR = Sphere((1e3, 0.0, 0.0), 1e-3)
"""An obstacle that nothing reaches."""
PATHS, RECORDING = "paths of obstacles and targets", "recording"
ENERGIES = "energies: no metric reads them"
"""Left out of recording, unless a case asks for them."""
STAGE, SKIPPED, FRAME = "stage", "skipped", "per frame"


@dataclass(frozen=True)
class Skip:
    """A stage that a scene may not need."""

    name: str
    applies: Callable[[Setup], bool]
    """Whether a set-up leaves it out."""
    included: Callable[[Setup, State], tuple[Setup, State]]
    """The same run with the stage."""
    told: Callable[[Setup, State], str] = lambda setup, state: ""
    """How much was left out, from the state after the run; comes after the name."""


def _with_far(setup: Setup, state: State) -> tuple[Setup, State]:
    return replace(setup, obstacles=(*setup.obstacles, FAR)), state


def _with_friction(setup: Setup, state: State) -> tuple[Setup, State]:
    rubbing = tuple(replace(o, friction=1e-300) if o in setup.solids else o for o in setup.obstacles)
    return replace(setup, obstacles=rubbing), state


def _with_rows(setup: Setup, state: State) -> tuple[Setup, State]:
    return setup, replace(state, rows=volume_rows(setup.body.kept, setup.body.node_count))


def _awake(setup: Setup, state: State) -> tuple[Setup, State]:
    assert state.probing is not None
    return setup, replace(state, probing=state.probing._replace(skipping=False))


def _pairs(setup: Setup, state: State) -> str:
    """Boxes compared, pairs tested and triangles left behind, of all pairs of tips and triangles."""
    assert state.probing is not None
    steps = setup.clock.frames * setup.clock.steps
    pairs, counts = state.probing.wake.size, state.probing.counts
    return (
        f": of {pairs:,} a step {counts[COMPARED] / steps:.3g} boxes compared, {counts[TESTED] / steps:.3g} pairs "
        f"tested; in contact {counts[IN_CONTACT]} of {steps} steps, left behind {counts[LEFT_BEHIND]}"
    )


def _is_division(setup: Setup) -> bool:
    return isinstance(setup.method, ImplicitVolume) and setup.start().rows is None


SKIPS: tuple[Skip, ...] = (
    Skip("contact: there is no obstacle", lambda s: not s.solids, _with_far),
    Skip("friction: no obstacle has any", lambda s: bool(s.solids) and not s.drive(0).rough, _with_friction),
    Skip("linear solve: one volume is a division", _is_division, _with_rows),
    Skip("pairs of tips and triangles out of reach", lambda s: bool(s.probes), _awake, _pairs),
)


def run_frames(setup: Setup, state: State, ticks: Ticks | None = None) -> tuple[np.ndarray, np.ndarray, State]:
    """Time of each frame [ns], (F,); of its ROWS, with what marking cost taken off, (rows, F); the last state."""
    state = replace(state, tally=state.tally._replace(ticks=ticks))
    clock = setup.clock
    frame_ns, stage_ns = np.zeros(clock.frames), np.zeros((len(ROWS), clock.frames))
    price = mark_ns() if ticks is not None else 0.0
    for frame in range(clock.frames):
        drive = setup.drive(frame)
        if ticks is not None:
            ticks.spent[:], ticks.marks[:] = 0, 0
        begin = perf_counter_ns()
        state = setup.method.advance(state, drive)
        frame_ns[frame] = perf_counter_ns() - begin
        if ticks is not None:
            # A stage of some nanoseconds may seem to cost less than its mark.
            stage_ns[:OUTSIDE, frame] = np.maximum(ticks.spent[:OUTSIDE] - price * ticks.marks[:OUTSIDE], 0.0)
            stage_ns[OUTSIDE, frame] = frame_ns[frame] - ticks.spent[:OUTSIDE].sum()
        reason = trouble(state, setup.body)
        if reason is not None:
            raise MassSpringError(f"the run broke off while its cost was measured: {reason}; take a smaller dt")
    return frame_ns, stage_ns, state


def stage_times(setup: Setup) -> np.ndarray:
    """Time of each of ROWS in each frame [ns], (rows, F): the second of two runs, the first one compiles."""
    run_frames(setup, setup.start(), new_ticks())
    return run_frames(setup, setup.start(), new_ticks())[1]


@numba.njit
def _marks(ticks, count):
    for _ in range(count):
        mark(ticks, INTEGRATION)


def mark_ns() -> float:
    """What a mark costs [ns]."""
    ticks = new_ticks()
    _marks(ticks, 1)
    begin = perf_counter_ns()
    _marks(ticks, MARKS)
    return (perf_counter_ns() - begin) / MARKS


def cost_table(case: Case, frames: int = FRAMES, repeats: int = REPEATS) -> pd.DataFrame:
    """Rows of stages, rest and the whole step [µs per step], skipped stages with what they would cost, and what Python
    does once per frame, over as many steps. Raises StudyError or MassSpringError for a case that cannot run."""
    setup = prepare(case.replaced(frames=min(frames, case.frames or case.scene.frames))).setup
    skipped = [skip for skip in SKIPS if skip.applies(setup)]
    runs = {"": (setup, setup.start())}
    for skip in skipped:
        runs[skip.name] = skip.included(setup, setup.start())
    ends: dict[str, State] = {}
    plain: dict[str, list[np.ndarray]] = {name: [] for name in runs}
    ticked: list[tuple[np.ndarray, np.ndarray]] = []
    with pinned(threads=1):
        for turn in range(-1, repeats):  # the first round compiles and is thrown away
            for name, (contestant, state) in runs.items():
                found, _, ends[name] = run_frames(contestant, state)
                if turn >= 0:
                    plain[name].append(found)
            marked = run_frames(setup, setup.start(), new_ticks())
            if turn >= 0:
                ticked.append(marked[:2])
        outside = _per_frame(setup)
    to_step = 1e-3 / setup.clock.steps
    whole = {name: to_step * float(np.min(times, axis=0).mean()) for name, times in plain.items()}
    stages = to_step * _fastest(ticked).mean(axis=1)
    rows = [(STAGE, name, cost, cost / whole[""]) for name, cost in zip(ROWS, stages, strict=True) if cost > 0]
    rest = whole[""] - float(stages.sum())
    rows += [(STAGE, "rest, not attributed", rest, rest / whole[""]), (STAGE, "whole step", whole[""], 1.0)]
    for skip in skipped:
        saved = whole[skip.name] - whole[""]
        rows.append((SKIPPED, skip.name + skip.told(setup, ends[""]), saved, saved / whole[""]))
    for name, ns in outside.items():
        kind = SKIPPED if name == ENERGIES else FRAME
        rows.append((kind, name, to_step * ns, to_step * ns / whole[""]))
    return pd.DataFrame(rows, columns=["kind", "what", "µs per step", "share of the step"])


def _fastest(ticked: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Times of ROWS in the fastest repeat of each frame, (rows, F)."""
    quickest = np.argmin([frame_ns for frame_ns, _ in ticked], axis=0)
    stages = np.stack([stage_ns for _, stage_ns in ticked])
    return stages[quickest, :, np.arange(stages.shape[2])].T


def _per_frame(setup: Setup) -> dict[str, float]:
    """What is done once per frame, outside its time, and what recording the energies too would take: median [ns]."""
    clock = setup.clock
    recorded = (setup.body, clock, setup.obstacles, len(setup.attachments), frozenset[int]())
    bare, full = Recorder(*recorded, ()), Recorder(*recorded, EXTRA)
    state = setup.method.advance(setup.start(), setup.drive(0))
    times = np.zeros((3, clock.frames))
    for frame in range(clock.frames):
        records = [partial(recorder.record, frame, state, 0) for recorder in (bare, full)]
        for row, work in enumerate([partial(setup.drive, frame), *records]):
            begin = perf_counter_ns()
            work()
            times[row, frame] = perf_counter_ns() - begin
    paths, recording, energies = (float(t) for t in np.median(times, axis=1))
    return {PATHS: paths, RECORDING: recording, ENERGIES: energies - recording}
