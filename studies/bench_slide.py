"""The slide lines of `make bench`: a thin probe on the refined stomach, at the rates of haptics and of video."""

from dataclasses import replace

import numpy as np

from massspring import Clock, Setup
from studies.adapt import prepare
from studies.bench_line import Line
from studies.case import BodyRecipe, Case
from studies.cost import run_frames
from studies.scenes.stomach_slide import NODES, STOMACH_SLIDE
from studies.spread import kernel_ns, percentiles
from studies.timing import interleave, pinned

UPDATE, FRAME = 2e-3, 1.0 / 30.0
"""Simulated and wall time between two forces on the hand, and between two pictures [s]."""
REPEATS = 5


def slide_setup() -> Setup:
    """The scene's own set-up at its own time step."""
    return prepare(Case(STOMACH_SLIDE, BodyRecipe("surface", nodes=NODES))).setup


def stepwise(setup: Setup) -> Setup:
    """The same run with one step in a frame, so that every step is timed with its call from Python."""
    clock = setup.clock
    return replace(setup, clock=Clock(clock.dt, clock.frames * clock.steps, 1))


def windows(step_ns: np.ndarray, dt: float, span: float) -> np.ndarray:
    """Time of the whole steps that every stretch of `span` simulated seconds needs [ns], (repeat, windows).

    An update may begin anywhere between two steps, so it needs as many steps as can end within it, ⌈span/dt⌉.
    """
    count = int(np.ceil(span / dt))
    total = np.cumsum(np.pad(step_ns, ((0, 0), (1, 0))), axis=1)
    return total[:, count:] - total[:, :-count]


def slide_lines() -> list[Line]:
    """A step in contact, and p99 of haptic updates and frames in the budgets that simulated time leaves."""
    setup = stepwise(slide_setup())
    with pinned(threads=1):
        step_ns = interleave({"slide": lambda: run_frames(setup, setup.start())[0]}, REPEATS)["slide"]
    dt = setup.clock.dt
    contact = step_ns[:, step_ns.shape[1] // 4 :]
    note = f"{setup.body.springs.count} springs, {len(setup.body.triangles)} triangles, dt = {1e3 * dt:.3g} ms"
    lines = [Line(f"stomach_slide, {NODES} nodes: a step", 1e-6 * kernel_ns(contact), "ms", 1e3 * dt, note=note)]
    for what, span in (("a 500 Hz update", UPDATE), ("a 30 Hz frame", FRAME)):
        late = percentiles(windows(contact, dt, span))["p99"]
        needs = f"{np.ceil(span / dt):.0f} steps with their calls, any stretch in contact; p99"
        lines.append(Line(f"stomach_slide: {what}", 1e-6 * late, "ms", 1e3 * span, note=needs))
    return lines
