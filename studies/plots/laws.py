"""Effect of the stiffness law: force error and step limit over mesh size, with one volume and with nodal volumes."""

from collections.abc import Callable, Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.typing import LineStyleType

from studies.base.counting import heading, readable
from studies.metrics.metric import Metric
from studies.metrics.metrics import METRICS
from studies.metrics.run import Run, by_scene
from studies.plots.style.page import (
    band_handle,
    blank,
    finish,
    grouped,
    log_axis,
    page,
    panels,
    remarks,
    unresolved_mark,
    unresolved_notes,
)
from studies.plots.style.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    MUTED,
    ORANGE,
    PURPLE,
    SKY,
    SPARE_LOOKS,
    VERMILLION,
    drawing,
    remark,
    styled,
)
from studies.store.schema import COMPARABLE

TITLE = "Stiffness laws: force and step limit"
COLOURS = {
    "van_gelder": BLUE,
    "uniform": ORANGE,
    "lloyd": PURPLE,
    "lloyd_matched": SKY,
    "cotangent": GREEN,
    "per_kind": VERMILLION,
}
"""Stiffness law -> colour."""
VOLUMES = {
    "tetrahedral": ("one volume", (0, (4, 1.6)), "o"),
    "tetrahedral, one volume": ("one volume", (0, (4, 1.6)), "o"),
    "surface": ("one volume", (0, (4, 1.6)), "o"),
    "tetrahedral, nodal volumes": ("one volume per node", "-", "^"),
}
"""BodyRecipe.series -> (words, line, marker); other bodies take a spare look and their series as words."""
Look = tuple[str, str, tuple[str, LineStyleType, str]]
"""Law, its colour, and words, line and marker of the volumes."""
FORCE, MS_PER_S = "force_end", 1e3


@styled
def figure(runs: Sequence[Run]) -> Figure:
    shown = [run for run in runs if run.record.status in COMPARABLE]
    if not shown:
        return blank(TITLE, "no run has finished yet")
    (metric,) = (metric for metric in METRICS if metric.name == FORCE)
    scenes, looks = by_scene(shown), _looks(shown)
    sheet = page(9.6, 3.4 * len(scenes) + 0.4)
    axes = panels(sheet, len(scenes), 2, sharex="col")
    sizes = sorted({run.case.body.nodes for run in shown})
    for row, (name, group) in zip(axes, scenes.items(), strict=True):
        row[0].set_title(heading(name) + unresolved_mark(group, [metric]))
        row[0].set_ylabel("force error, last checkpoint [%]")
        row[1].set_ylabel("step limit [ms]")
        _draw_force(row[0], group, metric, looks)
        _draw_lines(row[1], group, lambda run: MS_PER_S * run.attributes.dt_limit, looks)
        log_axis(row[1].yaxis)
        for panel in row:
            panel.set_xscale("log")
            panel.set_xticks(sizes, [f"{size:,}" for size in sizes])
            panel.set_xticks([], minor=True)
    for panel in axes[-1]:
        panel.set_xlabel("surface nodes [1]")
    notes = ["The step limit is that of symplectic Euler with the scene's damping; volumes do not lower it."]
    return finish(
        sheet, TITLE, _handles(looks), [*notes, *unresolved_notes(shown, [metric]), *remarks(runs)], columns=4
    )


def _looks(shown: Sequence[Run]) -> dict[int, Look]:
    """id of a run -> its look. Laws and bodies that are not in COLOURS and VOLUMES take the next spare ones."""
    laws, bodies = dict(COLOURS), dict(VOLUMES)
    colours, spare = cycle((BLACK, *MUTED)), cycle(SPARE_LOOKS)
    looks = {}
    for run in shown:
        law, series = _law(run), run.case.body.series
        if law not in laws:
            laws[law] = next(colours)
        if series not in bodies:
            bodies[series] = (series, *next(spare))
        looks[id(run)] = (law, laws[law], bodies[series])
    return looks


def _law(run: Run) -> str:
    return str(run.record.attributes.get("law", run.case.body.law))


def _draw_lines(axes: Axes, group: Sequence[Run], value: Callable[[Run], float], looks: dict[int, Look]) -> int:
    drawn = 0
    for same in grouped(group, lambda run: looks[id(run)]):
        points = sorted((run.case.body.nodes, value(run)) for run in same if np.isfinite(value(run)))
        _, colour, (_, line, marker) = looks[id(same[0])]
        if points:
            look = {"linestyle": line, "marker": marker, "markerfacecolor": _face(colour, marker)}
            axes.plot(*zip(*points, strict=True), color=colour, **look)
        drawn += len(points)
    return drawn


def _draw_force(axes: Axes, group: Sequence[Run], metric: Metric, looks: dict[int, Look]) -> None:
    uncertainty = metric.uncertainty(group[0])
    if uncertainty == uncertainty:
        axes.axhspan(-uncertainty, uncertainty, color=GREY, alpha=0.3, linewidth=0)
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    if not _draw_lines(axes, group, metric, looks):
        remark(axes, "no reference, no error" if group[0].reference is None else "not compared in this scene")


def _handles(looks: dict[int, Look]) -> list:
    laws = {law: colour for law, colour, _ in looks.values()}
    volumes = dict.fromkeys(volumes for _, _, volumes in looks.values())
    return [
        *(Line2D([], [], color=colour, linewidth=4, label=readable(law)) for law, colour in laws.items()),
        *(Line2D([], [], linestyle=line, marker=m, markerfacecolor=_face(BLACK, m), color=BLACK, label=words)
          for words, line, m in volumes),
        band_handle("uncertainty of the reference"),
    ]  # fmt: skip


def _face(colour: str, marker: str) -> str:
    """Colour inside a marker: that of nodal volumes is filled, any other hollow."""
    return colour if marker == "^" else "white"


draw = drawing(figure)
