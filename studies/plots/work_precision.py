"""What accuracy costs: error against computing time, over mesh size, time step and method."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from studies.metrics.metrics import COMPARABLE, METRICS, Metric, Run, real_time
from studies.plots.style.bodies import BodyLook, body_looks
from studies.plots.style.page import (
    band_handle,
    blank,
    by_scene,
    finish,
    grouped,
    log_axis,
    page,
    panels,
    remarks,
    unresolved_mark,
    unresolved_notes,
)
from studies.plots.style.style import BLACK, GREY, SMALL, heading, method_colour, readable, remark, save, styled
from studies.runs.case import BodyRecipe
from studies.store.record import Status

TITLE = "Accuracy for computing time"
ROWS = {"force_error": "force error [%]", "interior_error": "displacement error [%]"}
STEP_LINES = ("-", (0, (5, 2)), (0, (1.5, 1.5)), (0, (5, 2, 1.5, 2)))
MS_PER_S = 1e3


@styled
def figure(runs: Sequence[Run]) -> Figure:
    """One column of panels per scene, one row per quantity; a line joins the meshes of one method and step."""
    timed = [run for run in runs if run.timing is not None and run.record.status in COMPARABLE]
    if not timed:
        return blank(TITLE, "no frame times from this machine and this code yet")
    scenes, looks = by_scene(timed), body_looks(timed, ignored=("nodes",))
    metrics = [metric for name in ROWS for metric in METRICS if metric.name == name]
    sheet = page(4.6 * len(scenes) + 0.8, 6.4)
    axes = panels(sheet, len(metrics), len(scenes), sharex="col", sharey=True)
    steps = sorted({_step(run) for run in timed}, reverse=True)
    values = [1.0, 100.0]
    for column, (name, group) in zip(axes.T, scenes.items(), strict=True):
        column[0].set_title(heading(name) + unresolved_mark(group, metrics))
        column[-1].set_xlabel("computing time per simulated second [ms/s]")
        for panel, metric in zip(column, metrics, strict=True):
            values += _draw_panel(panel, group, metric, steps, looks)
            log_axis(panel.xaxis)
    for panel, metric in zip(axes[:, 0], metrics, strict=True):
        log_axis(panel.yaxis)
        panel.set_ylabel(ROWS[metric.name])
    axes[0, 0].set_ylim(0.7 * min(values), 1.2 * max(values))
    return finish(
        sheet,
        TITLE,
        _handles(timed, steps, looks),
        [_meaning(), *unresolved_notes(timed, metrics), *remarks(runs)],
        columns=3,
    )


def cost(run: Run) -> float:
    """Computing time per simulated second [ms/s]: what explicit steps of different size are compared by."""
    return MS_PER_S / real_time(run)


def _step(run: Run) -> float:
    """Time step over the stability limit, as asked for; as measured where it was given in seconds."""
    if run.case.dt == "auto":
        return run.case.dt_fraction
    return round(run.record.attributes["dt"] / run.record.attributes["dt_limit"], 2)


def _draw_panel(
    axes: Axes, group: Sequence[Run], metric: Metric, steps: Sequence[float], looks: dict[BodyRecipe, BodyLook]
) -> list[float]:
    """The values drawn."""
    uncertainty = metric.uncertainty(group[0])
    if uncertainty == uncertainty:
        axes.axhspan(1e-12, uncertainty, color=GREY, alpha=0.3, linewidth=0)
    drawn: list[float] = [uncertainty] if uncertainty == uncertainty else []
    lines = []
    for same in grouped(group, lambda run: (run.case.method.name, _step(run), looks[run.case.body])):
        line = sorted((run for run in same if metric(run) == metric(run)), key=lambda run: run.case.body.nodes)
        # Closer to the reference than it is to itself means no more than: as good as it.
        heights = [max(metric(run), uncertainty) if uncertainty == uncertainty else metric(run) for run in line]
        colour = method_colour(same[0].case.method.name)
        dashes = STEP_LINES[steps.index(_step(same[0])) % len(STEP_LINES)]
        axes.plot([cost(run) for run in line], heights, color=colour, linestyle=dashes, linewidth=1.5)
        for run, height in zip(line, heights, strict=True):
            _draw_point(axes, run, height, looks[run.case.body].marker)
        lines.append((line, heights))
        drawn += heights
    if metric.name == next(iter(ROWS)) and lines:
        _number(axes, *max(lines, key=lambda pair: _upper_left(*pair)))
    if group[0].reference is None:
        remark(axes, "no reference, no error")
    elif len(drawn) < 2:
        remark(axes, "not compared in this scene")
    return drawn


def _number(axes: Axes, line: Sequence[Run], heights: Sequence[float]) -> None:
    """Writes the nodes over the markers of one line."""
    place = {"xytext": (0, 8), "textcoords": "offset points", "ha": "center", "color": GREY, "size": SMALL}
    for run, height in zip(line, heights, strict=True):
        axes.annotate(f"{run.case.body.nodes:,}", (cost(run), height), **place)


def _upper_left(line: Sequence[Run], heights: Sequence[float]) -> float:
    """How far to the upper left a line lies, where no other is in the way: mean logarithm of error over cost."""
    return float(np.mean(np.log(heights) - np.log([cost(run) for run in line]))) if line else -np.inf


def _draw_point(axes: Axes, run: Run, height: float, marker: str) -> None:
    """A marker as large as its mesh; white inside where the run ended with a fault."""
    colour = method_colour(run.case.method.name)
    face = colour if run.record.status == Status.OK else "white"
    look = {"color": colour, "markerfacecolor": face, "markeredgewidth": 1.5}
    axes.plot(cost(run), height, marker=marker, markersize=_size(run.case.body.nodes), **look)


def _size(nodes: int) -> float:
    """Marker diameter [pt]: area in proportion to the nodes."""
    return 0.36 * np.sqrt(nodes)


def _handles(timed: Sequence[Run], steps: Sequence[float], looks: dict[BodyRecipe, BodyLook]) -> list:
    methods = dict.fromkeys(run.case.method.name for run in timed)
    look = {"color": BLACK, "linewidth": 1.5}
    lines = [
        Line2D([], [], linestyle=STEP_LINES[k % len(STEP_LINES)], label=f"step {step:g} of the stability limit", **look)
        for k, step in enumerate(steps)
    ]
    hollow = {"marker": "o", "color": BLACK, "markerfacecolor": "white", "linestyle": "", "markersize": 7}
    bodies = dict.fromkeys(looks.values())
    marks = [Line2D([], [], color=BLACK, marker=b.marker, linestyle="", markersize=7, label=b.name) for b in bodies]
    faults = sorted({readable(run.record.status) for run in timed if run.record.status != Status.OK})
    return [
        *(Line2D([], [], color=method_colour(name), marker="o", label=readable(name)) for name in methods),
        *lines,
        *(marks if len(marks) > 1 else []),
        band_handle("the reference's own uncertainty"),
        *([Line2D([], [], label=f"hollow: ended {', '.join(faults)}", **hollow)] if faults else []),
    ]


def _meaning() -> str:
    return (
        "Numbers and marker areas: surface nodes of the mesh. Displacement: volume-weighted "
        "relative L2 at the last checkpoint. Nothing is drawn below the uncertainty of the reference."
    )


def draw(runs: Sequence[Run], path: Path) -> None:
    """Writes the chart as PNG."""
    save(figure(runs), path)
