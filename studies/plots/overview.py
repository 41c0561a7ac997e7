"""The result in one chart: the error of the force against speed, of three kinds of bodies in every scene."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from studies.base.counting import readable
from studies.metrics.metrics import force_end, real_time
from studies.metrics.run import Run
from studies.plots.style.page import blank, finish, page, panels, timing_notes
from studies.plots.style.style import BLACK, GREEN, GREY, NORMAL, VERMILLION, drawing, styled
from studies.store.schema import COMPARABLE

TITLE = "Error of the force against speed"
KINDS = {"surface": BLACK, "tetrahedral": VERMILLION, "quadratic": GREEN}
NAMES = {
    "surface": "the paper's body",
    "tetrahedral": "tetrahedra, one kept volume",
    "quadratic": "quadratic, a volume per vertex",
}
MARKERS = "osD^vPXp<"
NOTES = [
    "At full load, one mesh of each size that was timed. In hollow organs wall and content are two kept volumes.",
    "Dotted: 3 %, the target of solid organs. Errors below 0.05 % are drawn there.",
]
SMALLEST = 0.05
"""Smaller errors are drawn here [%]: no reference knows a force better."""
Point = tuple[str, str, float, float]
"""Kind of body, scene, simulated over computing time [s/s], error of the force at full load [%]."""


def figure(runs: Sequence[Run]) -> Figure:
    """A marker for each timed body that has a reference: all sizes, none chosen by its error."""
    points = {id(run): point for run in runs if (point := _point(run)) is not None}
    return figure_of(list(points.values()), timing_notes([run for run in runs if id(run) in points]))


def _point(run: Run) -> Point | None:
    body = run.case.body
    shown = body.kind in KINDS and body.volumes in ("scene", "vertex") and run.case.method.name == "implicit_volume"
    if not shown or run.timing is None or run.reference is None or run.record.status not in COMPARABLE:
        return None
    return body.kind, run.case.scene.name, real_time(run), force_end(run)


@styled
def figure_of(points: Sequence[Point], notes: Sequence[str] = ()) -> Figure:
    """The chart of points; those whose error or speed is not known are left out."""
    points = [point for point in points if np.isfinite(point[2:]).all()]
    if not points:
        return blank(TITLE, "no timed run with a reference has finished yet")
    scenes = dict(zip(dict.fromkeys(point[1] for point in points), MARKERS * 9, strict=False))
    sheet = page(8.0, 4.4)
    axes = panels(sheet, 1, 1)[0][0]
    for kind, scene, speed, error in points:
        height = max(abs(error), SMALLEST)
        axes.plot(speed, height, scenes[scene], color=KINDS[kind], markersize=7, markeredgecolor="white", alpha=0.85)
    axes.set(xscale="log", yscale="log", ylim=(0.8 * SMALLEST, 2000))
    axes.axvline(1.0, color=GREY, linewidth=1)
    axes.text(1.05, 1500, "real time", color=GREY, size=NORMAL, va="top")
    axes.axhline(3.0, color=GREY, linewidth=1, linestyle=(0, (1, 2)))
    axes.set_xlabel("simulated over computing time, one core [s/s]")
    axes.set_ylabel("error of the force [%]")
    there = [kind for kind in KINDS if any(point[0] == kind for point in points)]
    handles = [Line2D([], [], color=KINDS[kind], marker="s", linestyle="", label=NAMES[kind]) for kind in there]
    handles += [Line2D([], [], color=GREY, marker=m, linestyle="", label=readable(s)) for s, m in scenes.items()]
    return finish(sheet, TITLE, handles, [*NOTES, *notes])


draw = drawing(figure)
