"""Every method on the same bodies: one row per method, one panel per quantity, one marker per scene."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from massspring import Method
from studies.base.counting import heading, readable
from studies.metrics.metric import Metric
from studies.metrics.metrics import METRICS, real_time
from studies.metrics.run import Run, by_scene
from studies.plots.style.bodies import body_looks
from studies.plots.style.page import (
    blank,
    finish,
    hollow_handle,
    log_axis,
    page,
    panels,
    remarks,
    timing_notes,
    unresolved_mark,
    unresolved_notes,
)
from studies.plots.style.style import BLUE, GREEN, GREY, ORANGE, PURPLE, SMALL, drawing, method_label, styled
from studies.runs.case import chosen_settings
from studies.store.schema import COMPARABLE

TITLE = "Ways to keep a volume: same bodies, same fraction of the step limit unless a step is named"
QUANTITIES = {
    "force_error": "force error [%]",
    "interior_error": "displacement error [%]",
    "silhouette_error": "silhouette error [%]",
    "volume_worst": "worst volume error [%]",
    "j_spread": "spread of J [%]",
}
COST = "computing time [ms/s]"
MS_PER_S = 1e3
SCENE_LOOKS = ((BLUE, "o"), (ORANGE, "s"), (GREEN, "^"), (PURPLE, "D"))
LEAST = 1e-4
"""Smaller values are drawn here, with an arrow [%]."""
APART = 0.12
"""Half the distance of the markers of two scenes in a row, over the distance of rows."""


def label(method: Method) -> str:
    """The name of a method and its settings other than the defaults: "element (bulk modulus 1e+06, hard)"."""
    label = []
    for name, value in chosen_settings(method).items():
        number = f" {value:g}" if not isinstance(value, (bool, str)) else f" {value}" if isinstance(value, str) else ""
        label.append(readable(name) + number)
    return method_label(method.name) + (f" ({', '.join(label)})" if label else "")


def row_names(runs: Sequence[Run]) -> dict[int, str]:
    """id of a run -> its method, what distinguishes its body from the others, and its step if that was chosen."""
    looks = body_looks(runs)
    common = {run.case.body.kind for run in runs}
    names = {}
    for run in runs:
        body = ", " + looks[run.case.body].name
        if len(common) == 1:
            body = body.removeprefix(f", {run.case.body.kind}")
        step = "" if run.case.dt == "auto" else f", steps of {1e3 * run.case.dt:g} ms"
        names[id(run)] = label(run.case.method) + body + step
    return names


@styled
def figure(runs: Sequence[Run]) -> Figure:
    """Panels share their rows; a dotted line in the colour of a scene is the uncertainty of its reference."""
    shown = [run for run in runs if run.record.status in COMPARABLE]
    if not shown:
        return blank(TITLE, "no run has finished yet")
    names = row_names(shown)
    rows = list(dict.fromkeys(names.values()))
    metrics = [metric for name in QUANTITIES for metric in METRICS if metric.name == name]
    timed = any(run.timing is not None for run in shown)
    scenes = by_scene(shown)
    columns = -(-(len(metrics) + timed) // 2)
    sheet = page(3.1 * columns + 2.4, 2 * (0.27 * len(rows) + 1.0))
    axes = panels(sheet, 2, columns, sharey=True)
    for panel, metric in zip(axes.flat, metrics, strict=False):
        panel.set_xlabel(QUANTITIES[metric.name])
        _draw(panel, names, scenes, metric)
    if timed:
        axes.flat[len(metrics)].set_xlabel(COST)
        _draw(axes.flat[len(metrics)], names, scenes, None)
    for spare in axes.flat[len(metrics) + timed :]:
        spare.set_axis_off()
    for panel in axes[:, 0]:
        panel.set_yticks(range(len(rows)), rows)
        panel.set_ylim(len(rows) - 0.5, -0.5)
    return finish(sheet, TITLE, _handles(scenes, metrics), _notes(shown, metrics, runs), columns=4)


def _draw(axes: Axes, names: dict[int, str], scenes: dict[str, list[Run]], metric: Metric | None) -> None:
    """Draws the panel of a metric, or of the computing time for None."""
    drawn: list[float] = []
    rows = list(dict.fromkeys(names.values()))
    for number, group in enumerate(scenes.values()):
        colour, marker = SCENE_LOOKS[number % len(SCENE_LOOKS)]
        uncertainty = (
            metric.uncertainty(group[0]) if metric is not None and metric.name != "volume_worst" else float("nan")
        )
        if uncertainty == uncertainty:
            axes.axvline(uncertainty, color=colour, linestyle=":", linewidth=1.5)
            drawn.append(uncertainty)
        for run in group:
            value = _value(run, metric)
            if value != value:
                continue
            least = max(LEAST, uncertainty) if uncertainty == uncertainty else LEAST
            height = rows.index(names[id(run)]) + APART * (2 * number - len(scenes) + 1)
            shape = marker if value > least else "<"
            face = "white" if metric is not None and metric.unresolved(run) else colour
            axes.plot(max(value, least), height, marker=shape, color=colour, markerfacecolor=face, markersize=6)
            drawn.append(max(value, least))
    if drawn:
        log_axis(axes.xaxis)
        axes.set_xlim(0.6 * min(drawn), 1.7 * max(drawn))
        if max(drawn) > 1e4 * min(drawn):
            axes.xaxis.set_major_locator(LogLocator(numticks=6))
    axes.set_axisbelow(True)
    axes.tick_params(axis="x", labelsize=SMALL)
    axes.tick_params(axis="y", length=0, labelsize=SMALL)


def cost(run: Run) -> float:
    """Computing time per simulated second [ms/s], which makes explicit steps of different size comparable."""
    return MS_PER_S / real_time(run)


def _value(run: Run, metric: Metric | None) -> float:
    if metric is not None:
        return abs(metric(run))
    return cost(run) if run.timing is not None else float("nan")


def _handles(scenes: dict[str, list[Run]], metrics: Sequence[Metric]) -> list:
    entries = []
    for number, (name, group) in enumerate(scenes.items()):
        colour, marker = SCENE_LOOKS[number % len(SCENE_LOOKS)]
        label = heading(name) + unresolved_mark(group, metrics)
        entries.append(Line2D([], [], color=colour, marker=marker, linestyle="", markersize=7, label=label))
    dotted = Line2D([], [], color=GREY, linestyle=":", label="uncertainty of the reference")
    return [*entries, dotted, hollow_handle(GREY)]


def _notes(shown: Sequence[Run], metrics: Sequence[Metric], runs: Sequence[Run]) -> list[str]:
    bodies = dict.fromkeys(
        f"{run.case.body.kind}, {run.case.body.nodes:,} surface nodes, dt {run.case.dt_fraction:g} of the limit"
        for run in shown
    )
    return [
        f"Body: {'; '.join(bodies)}; the limit includes the method's own stiffness. Force: over all checkpoints. "
        "Displacement: volume-weighted relative L2, not compared where rigid rotation is possible. J: 5th to 95th "
        "percentile at the last checkpoint. Computing time per simulated second, one core. Arrows: too small to draw.",
        *timing_notes(shown),
        *unresolved_notes(shown, metrics),
        *remarks(runs),
    ]


draw = drawing(figure)
