"""The slide lines of `make bench`: a thin probe on the refined stomach, at the rates of haptics and of video.

Simulated time is never behind wall time where a step takes no longer than dt: a device that is served after every step
is served 1/dt times a second. One with a clock of its own, 500 Hz, waits now for one step and now for two.
"""

from dataclasses import replace
from time import perf_counter_ns

import numpy as np

from massspring import Clock, MassSpringError, Setup
from massspring.run.simulation import check_state
from studies.bench.line import BenchLine
from studies.metrics.timing.protocol import interleave, pinned
from studies.metrics.timing.statistics import kernel_ns, percentiles
from studies.runs.case import BodyRecipe, Case
from studies.runs.prepare import prepare
from studies.scene.library.stomach_slide import NODES, STOMACH_SLIDE

UPDATE = 2e-3
"""Simulated and wall time between two forces on the hand [s]."""
REPEATS = 5
COUNTED = 25_000
"""Numbers that plain Python counts in half a millisecond or so."""
SAME = 1e-9
"""Of a step: an update that ends with a step does not wait for the next."""


def slide_setup() -> Setup:
    """The scene's own set-up at its own time step; its frames are those of video."""
    return prepare(Case(STOMACH_SLIDE, BodyRecipe("surface", nodes=NODES))).setup


def stepwise(setup: Setup) -> Setup:
    """The same run with one step in a frame, so that every step is timed with its call from Python."""
    clock = setup.clock
    return replace(setup, clock=Clock(clock.dt, clock.frames * clock.steps, 1))


def waited_ns(setup: Setup) -> np.ndarray:
    """Wall time from where the probe goes next to the new state, frame by frame [ns], (F,)."""
    state, times = setup.start(), np.zeros(setup.clock.frames)
    for frame in range(setup.clock.frames):
        begin = perf_counter_ns()
        state = setup.method.advance(state, setup.boundary(frame))
        times[frame] = perf_counter_ns() - begin
    reason = check_state(state, setup.body)
    if reason is not None:
        raise MassSpringError(f"the slide broke off while it was timed: {reason}; take a smaller dt")
    return times


def steps_of_updates(count: int, dt: float, span: float) -> np.ndarray:
    """How many steps each update of `span` [s] waits for, so that simulated time is not behind: of `count` steps."""
    reached = np.ceil(np.arange(int(count * dt / span * (1 + SAME)) + 1) * span / dt - SAME)
    return np.diff(reached).astype(np.int64)


def updates_ns(step_ns: np.ndarray, dt: float, span: float) -> np.ndarray:
    """Wall time of every update of a device that is served each `span` [s], wherever it begins [ns], (repeat, updates).

    step_ns: (repeat, steps). The runs that begin at the first steps, as many as the longest update has, in a row.
    """
    times = []
    for start in range(int(np.ceil(span / dt - SAME))):
        steps = steps_of_updates(step_ns.shape[1] - start, dt, span)
        ends = start + np.cumsum(steps)
        total = np.cumsum(np.pad(step_ns, ((0, 0), (1, 0))), axis=1)
        times.append(total[:, ends] - total[:, ends - steps])
    return np.concatenate(times, axis=1)


def counted_ns(frames: int) -> np.ndarray:
    """Times of a loop that has nothing to do with us, about as long as a step [ns], (F,)."""
    times = np.zeros(frames)
    for frame in range(frames):
        begin, total = perf_counter_ns(), 0
        for number in range(COUNTED):
            total += number & 1
        times[frame] = perf_counter_ns() - begin
    return times


def slide_lines() -> list[BenchLine]:
    """A step in contact, and p99 of updates and frames in the wall time that their simulated time leaves."""
    video = slide_setup()
    haptic, dt = stepwise(video), video.clock.dt
    with pinned(threads=1):
        runs = {"haptic": lambda: waited_ns(haptic), "video": lambda: waited_ns(video)}
        measured = interleave({**runs, "counting": lambda: counted_ns(haptic.clock.frames)}, REPEATS)
    step_ns, frame_ns, counting = (ns[:, ns.shape[1] // 4 :] for ns in measured.values())
    served = updates_ns(step_ns, dt, UPDATE)
    note = f"{video.body.springs.count} springs, {len(video.body.triangles)} triangles, dt = {1e3 * dt:.3g} ms"
    most = steps_of_updates(step_ns.shape[1], dt, UPDATE).max()
    late = (
        (f"an update after each step, {1 / dt:.0f} Hz", step_ns, dt, "simulated time = wall time; p99"),
        ("a 500 Hz update", served, UPDATE, f"up to {most} steps, so that simulated time is not behind; p99"),
        ("a 30 Hz frame", frame_ns, video.clock.frame, f"{video.clock.steps} steps in one call; p99"),
    )
    name = f"stomach_slide, {NODES} nodes"
    lines = [
        BenchLine(f"{name}: a step", 1e-6 * kernel_ns(frame_ns) / video.clock.steps, "ms", 1e3 * dt, note=note),
        BenchLine(f"{name}: a step with its call", 1e-6 * kernel_ns(step_ns), "ms", 1e3 * dt, note="as a device waits"),
    ]
    restless = percentiles(counting)["p99"] / kernel_ns(counting)
    for what, ns, span, needs in late:
        quantiles = percentiles(ns)
        note = f"{needs}; median {1e-6 * quantiles['p50']:.3g}"
        lines.append(BenchLine(f"stomach_slide: {what}", 1e-6 * quantiles["p99"], "ms", 1e3 * span, note=note))
    what = "a loop of plain Python, at its fastest as long as that step with its call: the limit of the machine"
    note = f"p99; {restless:.3g} times the fastest"
    return [*lines, BenchLine(what, 1e-6 * restless * kernel_ns(step_ns), "ms", note=note)]
