"""What accuracy costs: errors of force and displacement over computing time."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from studies.base.counting import heading, readable
from studies.exchange.entry import is_entry
from studies.metrics.cells import DISTURBED_MARK
from studies.metrics.judged import DISPLACEMENT, FORCE, Judged, Measured, cheapest, front, judged, over_meshes
from studies.metrics.metric import Metric
from studies.metrics.run import Run, by_scene
from studies.metrics.wish import usual_wish
from studies.plots.style.families import OUTSIDE, PAPER, Family, family_of
from studies.plots.style.page import (
    blank,
    finish,
    first_of,
    log_axis,
    page,
    panels,
    remarks,
    timing_notes,
    unresolved_mark,
    unresolved_notes,
)
from studies.plots.style.style import BLACK, GREEN, GREY, SMALL, drawing, remark, styled
from studies.runs.recipes import BodyRecipe
from studies.scene.scene import Scene
from studies.store.record import Status

TITLE = "Accuracy for computing time: down and to the left is better"
COLUMNS = 3
"""Most scenes in a row."""
ROWS = {FORCE.name: "error of the force [%]", DISPLACEMENT.name: "mean error / largest u [%]"}
FIELDS = {FORCE.name: "force", DISPLACEMENT.name: "displacement"}
"""Fields of a target (Wish) and of a judged case."""
REAL_TIME, HALF = 1.0, 0.5
"""Computing time over simulated time [1]."""
ROOM, BELOW, SIDE = 1.6, 3.0, 2.0
"""Factors between the outermost values and the ends of the axes: above, below (with room for a name), at the sides."""
UNTIMED = (0, (6, 2))
"""Line of a case whose time is unknown."""
STARS = ("*", (4, 1, 0), (5, 1, 36))
"""Markers that have little area."""
LOWEST, HIGHEST = 1e-3, 1e3
"""Errors outside these limits are drawn at them [%]."""


def figure(runs: Sequence[Run]) -> Figure:
    scenes = {name: _judged(group) for name, group in by_scene(runs).items()}
    scenes = {name: bodies for name, bodies in scenes.items() if bodies}
    if not scenes:
        return blank(TITLE, "no frame times from this machine and this code yet")
    return figure_of(scenes, runs)


@styled
def figure_of(scenes: dict[str, list[Judged]], runs: Sequence[Run]) -> Figure:
    """Cases by scene; runs: those that notes are about. A case without a time is a line at its error."""
    shown = [run for run in runs if run.case.scene.name in scenes]
    columns = min(COLUMNS, len(scenes))
    blocks = -(-len(scenes) // columns)
    sheet = page(min(12.0, 3.9 * columns + 0.6), 5.4 * blocks + 0.4)
    axes = panels(sheet, 2 * blocks, columns, sharex=True, sharey="row")
    for spare in range(len(scenes), blocks * columns):
        for row in (0, 1):
            axes[2 * (spare // columns) + row, spare % columns].set_axis_off()
    heights: list[list[float]] = [[] for _ in range(2 * blocks)]
    low, high = _ends(
        [one.cost.value for group in scenes.values() for one in group if one.cost.known] + [REAL_TIME, HALF]
    )
    for place, (name, bodies) in enumerate(scenes.items()):
        column = axes[2 * (place // columns) : 2 * (place // columns) + 2, place % columns]
        group = [run for run in shown if run.case.scene.name == name]
        column[0].set_title(heading(name) + unresolved_mark(group, (FORCE, DISPLACEMENT)))
        column[0].set_xlim(low, high)
        for row, drawn in enumerate(_draw_scene(column, bodies, group[0].case.scene)):
            heights[2 * (place // columns) + row] += drawn
    for row, metric, drawn in zip(axes, (FORCE, DISPLACEMENT) * blocks, heights, strict=True):
        row[0].set_ylim(max(LOWEST, min(drawn or [0.3])) / BELOW, ROOM * max(drawn or [60.0]))
        row[0].set_ylabel(ROWS[metric.name])
        log_axis(row[0].yaxis)
    for panel in axes[-1]:
        panel.set_xlabel("computing time / simulated time [s/s]")
    log_axis(axes[-1, 0].xaxis)
    notes = [*_notes(scenes), *timing_notes(shown), *_left_out(runs), *unresolved_notes(shown, (FORCE, DISPLACEMENT))]
    return finish(sheet, TITLE, _handles(scenes), notes, columns=3)


def _judged(group: Sequence[Run]) -> list[Judged]:
    bodies = over_meshes(one for one in map(judged, group) if one is not None and not one.bounds)
    return [one for one in bodies if one.cost.known or is_entry(one.case)]


def _ends(values: Sequence[float]) -> tuple[float, float]:
    return min(values) / SIDE, SIDE * max(values)


def _draw_scene(column: np.ndarray, bodies: Sequence[Judged], scene: Scene) -> list[list[float]]:
    """Draws the two panels of a scene; returns the heights drawn in each [%]."""
    wish, heights = usual_wish(scene), []
    recommended = cheapest(bodies, wish)
    for panel, metric in zip(column, (FORCE, DISPLACEMENT), strict=True):
        points = [(one, getattr(one, FIELDS[metric.name])) for one in bodies]
        points = [(one, error) for one, error in points if error.known]
        bound = getattr(wish, FIELDS[metric.name])
        _draw_goals(panel, bound)
        if not points:
            remark(panel, "no reference, no error" if not any(one.compared for one in bodies) else _why_not(metric))
            heights.append([])
            continue
        timed = [(one, error) for one, error in points if one.cost.known]
        if timed:
            _draw_front(panel, timed)
        heights.append([bound, *(_height(error) for _, error in points)])
        for one, error in points:
            if one.cost.known:
                _draw_point(panel, one, error, FIELDS[metric.name])
            else:
                panel.axhline(_height(error), color=family_of(one.case).colour, linewidth=1.6, linestyle=UNTIMED)
        _name(panel, timed, recommended)
    return heights


def _why_not(metric: Metric) -> str:
    return f"the scene compares no {FIELDS[metric.name]}"


def _draw_goals(panel: Axes, bound: float) -> None:
    """Draws the area that is accurate enough (bound [%]) in real time, and lines at real time and half of it."""
    panel.fill_between([1e-9, REAL_TIME], 1e-12, bound, color=GREEN, alpha=0.12, linewidth=0)
    panel.axvline(REAL_TIME, color=BLACK, linewidth=1.4)
    panel.axvline(HALF, color=BLACK, linewidth=1.0, linestyle=(0, (1.5, 2)))


def _draw_front(panel: Axes, points: Sequence[tuple[Judged, Measured]]) -> None:
    best = front([(one.cost.value, _height(error)) for one, error in points])
    panel.step(*zip(*best, strict=True), where="post", color=GREY, linewidth=1.2, zorder=1)


def _height(error: Measured) -> float:
    """Height of an error [%]: at least the uncertainty of the reference, because smaller errors are not resolved."""
    uncertainty = error.uncertainty if error.uncertainty == error.uncertainty else 0.0
    return float(np.clip(max(abs(error.value), uncertainty), LOWEST, HIGHEST))


def _draw_point(panel: Axes, one: Judged, error: Measured, field: str) -> None:
    """Draws a marker, with the uncertainty of the reference up and down and the spread of the repeats to the sides.

    For several meshes the marker is the median, and the bar also covers the smallest and the largest error.
    """
    look, heights = family_of(one.case), [_height(getattr(mesh, field)) for mesh in one.members or (one,)]
    height = float(np.median(heights))
    uncertainty = error.uncertainty if error.uncertainty == error.uncertainty else 0.0
    up, down = max(heights) - height + uncertainty, height - min(heights) + uncertainty
    wide = one.cost.uncertainty if one.cost.uncertainty == one.cost.uncertainty else 0.0
    down, left = min(down, 0.95 * height), min(wide, 0.95 * one.cost.value)
    panel.errorbar(
        one.cost.value,
        height,
        xerr=[[left], [wide]],
        yerr=[[down], [up]],
        color=look.colour,
        marker=look.marker,
        markersize=_size(look),
        markeredgecolor="white",
        markeredgewidth=0.5,
        elinewidth=1.0,
        zorder=2,
    )
    if one.disturbed:
        panel.annotate(DISTURBED_MARK, (one.cost.value, height), (5, -3), textcoords="offset points", size=SMALL)


def _size(look: Family) -> float:
    return 11.0 if look.marker in STARS or look.marker == OUTSIDE else 8.0


def _name(panel: Axes, points: Sequence[tuple[Judged, Measured]], recommended: Judged | None) -> None:
    papers = [(one, error) for one, error in points if family_of(one.case).name == PAPER]
    if papers:
        one, error = max(papers, key=lambda pair: pair[0].cost.value)
        _write(panel, one, error, PAPER, "bottom")
    for one, error in points:
        if is_entry(one.case):
            _write(panel, one, error, one.case.method.name.replace("_", " "), "top")
        if one is recommended:
            # No point lies to the lower left of a point on the front.
            _write(panel, one, error, "recommended", "top")
            panel.plot(one.cost.value, _height(error), marker="o", markersize=15, markerfacecolor="none", color=BLACK)


def _write(panel: Axes, one: Judged, error: Measured, words: str, vertical: str) -> None:
    left, right = panel.get_xlim()
    in_left = one.cost.value < np.sqrt(left * right)
    panel.annotate(
        words,
        (one.cost.value, _height(error)),
        xytext=(9 if in_left else -9, -7 if vertical == "top" else 2),
        textcoords="offset points",
        ha="left" if in_left else "right",
        va=vertical,
        size=SMALL,
        weight="bold" if vertical == "top" else "normal",
        zorder=3,
        path_effects=[withStroke(linewidth=2.5, foreground="white")],  # readable on the front and its points
    )


def words_of(body: BodyRecipe) -> str:
    return f"{body.series}, {body.nodes:,} surface nodes"


def _notes(scenes: dict[str, list[Judged]]) -> list[str]:
    notes = [
        "Green: force within 3 % and displacement within 1 % (hollow organs 6 and 3 %) in real time on one core. Bars: "
        "uncertainty of the reference, range over five neighbouring meshes where there are five (the marker is their "
        "median), and spread of up to five timings. Nothing is drawn below the uncertainty."
    ]
    best = {name: cheapest(bodies, usual_wish(bodies[0].case.scene)) for name, bodies in scenes.items()}
    named = [f"{readable(name)}: {words_of(one.case.body)}" for name, one in best.items() if one is not None]
    lacking = [readable(name) for name, one in best.items() if one is None]
    if named:
        notes.append(f"Recommended, the cheapest that is accurate enough: {'; '.join(named)}.")
    if lacking:
        notes.append(f"No body is accurate enough and keeps the shape of its organ in {', '.join(lacking)}.")
    return notes


def _left_out(runs: Sequence[Run]) -> list[str]:
    ended = [f"{run.case.name} {readable(run.record.status)}" for run in runs if run.record.status != Status.OK]
    well = [run for run in runs if run.record.status == Status.OK]
    notes = remarks(well)
    if ended:
        notes.append(f"Not drawn, because they failed: {first_of(ended)}.")
    bodies = [one for group in by_scene(well).values() for one in over_meshes(filter(None, map(judged, group)))]
    untimed = sum(
        not one.cost.known and not is_entry(one.case) for one in bodies
    )  # of several neighbouring meshes only one is timed
    if untimed:
        notes.append(f"Not drawn (no frame times for this machine and code version): {untimed}.")
    return notes


def _handles(scenes: dict[str, list[Judged]]) -> list[Line2D]:
    cases = [one for bodies in scenes.values() for one in bodies]
    looks = dict.fromkeys(family_of(one.case) for one in cases if one.cost.known)
    untimed = dict.fromkeys(family_of(one.case) for one in cases if not one.cost.known)
    plain = {"linestyle": "", "markeredgecolor": "white", "markeredgewidth": 0.5}
    return [
        *(
            Line2D([], [], color=look.colour, marker=look.marker, markersize=_size(look), label=look.name, **plain)
            for look in looks
        ),
        *(
            Line2D([], [], color=look.colour, linewidth=1.6, linestyle=UNTIMED, label=f"{look.name}, no time given")
            for look in untimed
        ),
        Line2D([], [], color=GREY, linewidth=1.2, label="best for the time"),
        Line2D([], [], color=BLACK, linewidth=1.4, label="real time"),
        Line2D([], [], color=BLACK, linewidth=1.0, linestyle=(0, (1.5, 2)), label="half of it"),
    ]


draw = drawing(figure)
