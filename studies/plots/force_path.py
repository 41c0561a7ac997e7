"""The probed force while a scene is pressed and then held, and the reference at its checkpoints."""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from massspring import Trajectory
from studies.base.counting import heading
from studies.metrics.metrics import METRICS, force_end
from studies.metrics.run import Run, by_scene
from studies.plots.style.bodies import BodyLook, body_looks, body_method_handles
from studies.plots.style.page import (
    band_handle,
    blank,
    finish,
    good_frames,
    grouped,
    has_frames,
    panel_grid,
    reference_handle,
    remarks,
    signed_percent,
    spread_out,
    unresolved_mark,
    unresolved_notes,
)
from studies.plots.style.style import BLACK, GREY, SMALL, drawing, styled
from studies.runs.recipes import BodyRecipe
from studies.scene.scene import Scene
from studies.store.schema import COMPARABLE

TITLE, AGAINST = "Force", " against the reference"
CUT_TITLE = "Force on the end that is moved, of a body that is cut"
FORCES = [metric for metric in METRICS if metric.name == "force_end"]
"""Metrics that are written at the ends of the lines."""
ROOM = 1.06
"""Top of the axis over the largest force."""
LABEL_GAP = 0.085
"""Smallest distance of two labels over the height of the axis: one line of text."""


@styled
def figure(runs: Sequence[Run]) -> Figure:
    shown = [run for run in runs if has_frames(run) and "force" in run.case.scene.quantities]
    if not shown:
        return blank(TITLE, "no run of a scene that asks for a force has recorded a frame yet")
    scenes, looks = by_scene(shown), body_looks(shown)
    sheet, axes = panel_grid(len(scenes), 2, (5.2, 3.0), (0.0, 0.4))
    for panel, group in zip(axes.flat, scenes.values(), strict=False):
        _draw_scene(panel, group, looks)
    handles, against = body_method_handles(shown, looks), ""
    if any(group[0].reference is not None for group in scenes.values()):
        handles += [reference_handle(linestyle="-", linewidth=1), band_handle("± its uncertainty")]
        against = AGAINST
    cut = any(run.case.scene.cuts for run in shown)
    dotted = "the cut, and the end of the motion" if cut else "the motion ends"
    number = "error there" if against else "force there"
    notes = [f"At the end of each line: its {number}, once everything is at rest. Dotted: {dotted}."]
    return finish(
        sheet,
        (CUT_TITLE + "," * bool(against) if cut else TITLE) + against,
        handles,
        [*notes, *remarks(runs), *unresolved_notes(shown, FORCES)],
        columns=3,
    )


def _draw_scene(axes: Axes, group: Sequence[Run], looks: dict[BodyRecipe, BodyLook]) -> None:
    ends = []
    for same in grouped(group, lambda run: (run.case.body, run.case.method.name)):
        run = same[0]  # runs with another time step lie on nearly the same line; the table shows the differences
        good = slice(0, good_frames(run))
        colour = looks[run.case.body].colour(run.case.method.name)
        axes.plot(run.fields.t[good], run.force[good], color=colour, linestyle=looks[run.case.body].line)
        ends.append((float(run.force[good][-1]), _error(run), colour))
    low, top = _range(group)
    motion = _motion(group[0].case.scene)
    cuts, stop = group[0].case.scene.cuts, motion.times[-1]
    _draw_reference(axes, group[0], stop, min((cut.at for cut in cuts), default=math.inf))
    for at in sorted({stop}.union(*({cut.at, cut.ends} for cut in cuts))):
        axes.axvline(at, color=GREY, linewidth=1, linestyle=":")
    _label(axes, ends, low, top)
    axes.set(xlim=(0, 1.015 * group[0].case.scene.duration), ylim=(low, top), xlabel="time [s]", ylabel="force [N]")
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    mark = unresolved_mark(group, FORCES)
    axes.set_title(f"{heading(group[0].case.scene.name)}{mark}, {_way(group[0], motion)}in {motion.times[-1]:g} s")


def _way(run: Run, motion: Trajectory) -> str:
    """How far the probed body moves, an obstacle from its first contact, in words: "20 mm "; "2 × 15 mm " where another
    one comes as far from the other side.

    Empty for an obstacle without a reference: its nodes give the first contact, which a coarse body misses.
    """
    bodies = run.case.scene.obstacles if run.case.scene.probed.what == "obstacle" else run.case.scene.held
    opposite = -np.array(motion.displacements)
    facing = [other for other in bodies if np.array_equal(other.path.displacements, opposite) and opposite.any()]
    times = "2 × " if facing else ""
    way = float(np.linalg.norm(motion.displacements[-1]))
    if run.case.scene.probed.what == "obstacle":
        if run.reference is None:
            return ""
        press, corners = run.case.scene.obstacles[run.case.scene.probed.number], run.reference.field("nodes")
        signs = np.array(list(product((1.0, -1.0), repeat=3))) if run.case.scene.symmetric else np.ones((1, 3))
        way -= float(press.gap((signs[:, None] * corners).reshape(-1, 3), 0.0).min())
    return f"{times}{round(1e3 * way, 1):g} mm "


def _motion(scene: Scene) -> Trajectory:
    bodies = scene.obstacles if scene.probed.what == "obstacle" else scene.held
    return bodies[scene.probed.number].path


def _error(run: Run) -> str:
    if run.record.status not in COMPARABLE:
        return str(run.record.status)
    error = force_end(run)  # unknown without a reference, and where the scene compares no force
    return f"{run.force[run.checkpoint_frames[-1]]:.2g} N" if error != error else signed_percent(error)


def _label(axes: Axes, ends: Sequence[tuple[float, str, str]], low: float, top: float) -> None:
    # A diverging line ends outside the axis; its label stays at the border.
    forces = np.array([force if np.isfinite(force) else top for force, _, _ in ends])
    heights = (np.clip(forces, low, top) - low) / (top - low)
    for at, (_, text, colour) in zip(spread_out(heights, LABEL_GAP, 1.0), ends, strict=True):
        axes.text(1.015, at, text, transform=axes.transAxes, color=colour, size=SMALL, va="center", ha="left")


def _draw_reference(axes: Axes, run: Run, stop: float, cut: float) -> None:
    """Draws the path of equilibria of the reference, interrupted at the time `cut` [s].

    From `stop` [s] on the press rests, and the path is constant at the last equilibrium.
    """
    if run.reference is None:
        return
    t, force = run.reference.field("t"), run.reference.force
    path_t = np.append(t[t < stop], (stop, max(t[-1], stop)))
    path = np.append(force[t < stop], (force[-1], force[-1]))
    # The uncertainty is relative to the norm over all checkpoints; each of them gets an equal share of it.
    spread = run.reference.total_uncertainty["force"] * np.linalg.norm(force) / np.sqrt(len(force))
    for side in (path_t <= cut, path_t > cut):
        axes.fill_between(
            path_t[side], (path - spread)[side], (path + spread)[side], color=GREY, alpha=0.3, linewidth=0
        )
        axes.plot(path_t[side], path[side], color=BLACK, linewidth=1)
    axes.plot(t, force, color=BLACK, marker="o", linestyle="", markersize=5.5, markeredgecolor="white", zorder=5)


def _range(group: Sequence[Run]) -> tuple[float, float]:
    """Ends of the axis [N], from the forces of the reference and of runs that ended well.

    From zero to the largest force, or from the smallest force to zero if that is farther from zero.
    """
    forces = [run.force for run in group if run.record.status in COMPARABLE]
    forces += [run.reference.force for run in group[:1] if run.reference is not None]
    lowest, highest = (float(end([0.0, *(end(force) for force in forces)])) for end in (np.min, np.max))
    return (0.0, ROOM * highest or 1.0) if highest >= -lowest else (ROOM * lowest, 0.0)


draw = drawing(figure)
