"""Errors of each body and method in four quantities, with the uncertainty of the reference."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from studies.base.counting import heading, readable
from studies.metrics.metric import RESOLVED_SHARE, Metric
from studies.metrics.metrics import METRICS
from studies.metrics.run import Run, by_scene
from studies.plots.style.bodies import BodyLook, body_looks, body_method_handles
from studies.plots.style.page import (
    band_handle,
    blank,
    finish,
    grouped,
    has_frames,
    hollow_handle,
    log_axis,
    panel_grid,
    remarks,
    unresolved_mark,
    unresolved_notes,
)
from studies.plots.style.style import BLACK, GREY, SMALL, drawing, remark, styled
from studies.runs.recipes import BodyRecipe
from studies.store.record import Status

TITLE = "Error against the reference"
QUANTITIES = {
    "force_error": "force",
    "surface_error": "surface",
    "interior_error": "interior",
    "silhouette_error": "silhouette",
}
ROOM = 1.7
"""Top of the axis over the largest value, so that its marker is not clipped."""
REACH = 0.38
"""Half the width of a group of points; groups are 1 apart."""
STRUCK_OUT = {"marker": "x", "linestyle": "", "color": BLACK, "markersize": 11, "markeredgewidth": 1.4}


@styled
def figure(runs: Sequence[Run]) -> Figure:
    shown = [run for run in runs if has_frames(run)]
    if not shown:
        return blank(TITLE, "no run has recorded a frame yet")
    metrics = [metric for metric in METRICS if metric.name in QUANTITIES]
    scenes, looks = by_scene(shown), body_looks(shown)
    sheet, axes = panel_grid(len(scenes), 2, (5.2, 3.0), (0.0, 0.4), sharey=True)
    values = [0.1, 100.0]
    for panel, (name, group) in zip(axes.flat, scenes.items(), strict=False):
        panel.set_title(heading(name) + unresolved_mark(group, metrics))
        values += _draw_scene(panel, group, metrics, looks)
    for panel in axes[:, 0]:
        log_axis(panel.yaxis)
        panel.set_ylim(min(values) / ROOM, ROOM * max(values))
        panel.set_ylabel("relative error [%]")
    return finish(
        sheet, TITLE, _handles(shown, looks), [*_notes(), *unresolved_notes(shown, metrics), *remarks(runs)], columns=3
    )


def _draw_scene(
    axes: Axes, group: Sequence[Run], metrics: Sequence[Metric], looks: dict[BodyRecipe, BodyLook]
) -> list[float]:
    """Draws the errors of a scene; returns the values drawn [%], errors and uncertainties of the reference."""
    series = grouped(group, lambda run: (looks[run.case.body], run.case.method.name))
    offsets = np.linspace(-REACH, REACH, len(series) + 2)[1:-1]
    drawn: list[float] = []
    for place, metric in enumerate(metrics):
        uncertainty = metric.uncertainty(group[0])
        if metric.quantity in group[0].case.scene.quantities and uncertainty == uncertainty:
            axes.fill_between([place - REACH, place + REACH], 0, uncertainty, color=GREY, alpha=0.3, linewidth=0)
            drawn.append(uncertainty)
        points = [(place + off, run) for off, same in zip(offsets, series, strict=True) for run in same]
        values = [(x, run, metric(run)) for x, run in points]
        drawn += [_draw_point(axes, x, error, uncertainty, run, looks) for x, run, error in values if error == error]
        if group[0].reference is not None and all(error != error for _, _, error in values):
            axes.text(
                place, 0.1, "not\ncompared", transform=axes.get_xaxis_transform(), ha="center", color=GREY, size=SMALL
            )
    if not drawn:
        remark(axes, "no reference, no error" if group[0].reference is None else "no run to compare")
    axes.set_xticks(range(len(metrics)), [QUANTITIES[metric.name] for metric in metrics])
    axes.tick_params(axis="x", length=0, labelsize=SMALL)
    axes.grid(visible=False, axis="x")
    axes.set_xlim(-0.5, len(metrics) - 0.5)
    return drawn


def _draw_point(
    axes: Axes, x: float, error: float, uncertainty: float, run: Run, looks: dict[BodyRecipe, BodyLook]
) -> float:
    """Draws a filled marker if the uncertainty of the reference is at most RESOLVED_SHARE of the error, else a hollow
    one, and strikes out a run that did not end ok. Returns the height [%], which is not below the uncertainty."""
    height = max(error, uncertainty)
    colour = looks[run.case.body].colour(run.case.method.name)
    face = colour if uncertainty <= RESOLVED_SHARE * error else "white"
    marker = looks[run.case.body].marker if error > uncertainty else "_"
    axes.plot(x, height, marker=marker, color=colour, markerfacecolor=face, markersize=7.5, markeredgewidth=1.6)
    if run.record.status != Status.OK:
        axes.plot(x, height, **STRUCK_OUT)
    return height


def _struck_out(shown: Sequence[Run]) -> list[Line2D]:
    """The legend entry of runs that did not end ok; [] if there are none."""
    states = sorted({readable(run.record.status) for run in shown if run.record.status != Status.OK})
    return [Line2D([], [], label=f"struck out: {', '.join(states)}, no sound result", **STRUCK_OUT)] if states else []


def _handles(shown: Sequence[Run], looks: dict[BodyRecipe, BodyLook]) -> list:
    return [
        *body_method_handles(shown, looks, markers=True),
        hollow_handle(BLACK),
        band_handle("uncertainty of the reference"),
        *_struck_out(shown),
    ]


def _notes() -> list[str]:
    return [
        "Force: over all checkpoints. Surface, interior: displacement, relative L2; not compared where rigid rotation "
        "is possible. Silhouette: Hausdorff distance over body size. Nothing is drawn below the uncertainty of the "
        "reference: a bar on that line is only an upper bound."
    ]


draw = drawing(figure)
