"""Errors over a population: the share of members that are at most so far off, a line for each body."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from studies.base.counting import heading
from studies.metrics.distribution import BOUND, ENOUGH, Group, groups
from studies.metrics.metric import Metric
from studies.metrics.run import Run
from studies.metrics.table import metric
from studies.plots.style.families import family_of
from studies.plots.style.page import band_handle, blank, finish, log_axis, page, panels
from studies.plots.style.style import GREY, SMALL, drawing, remark, styled

TITLE = "Randomly generated organs: share of a population within an error"
SHOWN = {"force_end": "error of the force [%]", "mean_error": "mean error / largest u [%]"}
LOWEST = 0.02
"""Errors below are drawn at the edge [%]."""
STYLES = ("-", (0, (4, 1.6)), (0, (1, 1.2)))
"""Of the sizes of one kind of body, small to large."""


@styled
def figure(runs: Sequence[Run]) -> Figure:
    """A column for each organ, a row for each metric."""
    found = [group for group in groups(runs) if _errors(group, metric("force_end"))]
    organs = list(dict.fromkeys(group.organ for group in found))
    if not organs:
        return blank(TITLE, "no member has been judged yet")
    sheet = page(3.9 * len(organs) + 0.8, 6.4)
    axes = panels(sheet, len(SHOWN), len(organs), sharey=True, sharex="row")
    handles: dict[str, Line2D] = {}
    for column, organ in zip(axes.T, organs, strict=True):
        mine = [group for group in found if group.organ == organ]
        members = {run.case.scene.name for group in mine for run in group.runs}
        column[0].set_title(f"{heading(organ)} ({len(members)})")
        for panel, (name, label) in zip(column, SHOWN.items(), strict=True):
            handles |= _draw(panel, mine, metric(name))
            panel.set_xlabel(label)
            log_axis(panel.xaxis)
            panel.set_ylim(0.0, 1.02)
    for panel in axes[:, 0]:
        panel.set_ylabel("share of the members")
    legend = [*handles.values(), band_handle("uncertainty of the references, smallest to largest")]
    return finish(sheet, TITLE, legend, _notes(found), columns=3)


def _errors(group: Group, entry: Metric) -> list[float]:
    """Absolute errors of the members that were judged, ascending."""
    return sorted(max(abs(value), LOWEST) for value in group.values(entry)[0].values() if value == value)


def _draw(panel: Axes, mine: Sequence[Group], entry: Metric) -> dict[str, Line2D]:
    """The lines of one panel; a handle for each body by its name."""
    handles, sizes = {}, dict[str, int]()
    panel.axhline(BOUND, color=GREY, linewidth=1.0, linestyle=(0, (1.5, 2)))
    panel.text(
        0.015, BOUND - 0.015, "95 of 100", transform=panel.get_yaxis_transform(), size=SMALL, color=GREY, va="top"
    )
    floors = [v for group in mine for v in group.values(entry)[1].values() if v == v]
    if floors:
        panel.axvspan(max(min(floors), LOWEST), max(floors), color=GREY, alpha=0.2, linewidth=0)
    for group in mine:
        errors = _errors(group, entry)
        if not errors:
            continue
        look = family_of(group.runs[0].case)
        style = STYLES[min(sizes.setdefault(look.name, 0), len(STYLES) - 1)]
        sizes[look.name] += 1
        share = np.arange(1, len(errors) + 1) / len(group.runs)
        panel.step(errors, share, where="post", color=look.colour, linestyle=style, linewidth=1.7)
        label = f"{look.name}, {group.runs[0].case.body.nodes} nodes"
        handles[label] = Line2D([], [], color=look.colour, linestyle=style, linewidth=1.7, label=label)
    if not handles:
        remark(panel, "nothing is known")
    return handles


def _notes(found: Sequence[Group]) -> list[str]:
    notes = []
    for organ in dict.fromkeys(group.organ for group in found):
        mine = [group.of(metric("force_end")) for group in found if group.organ == organ]
        count, lost = max(d.count for d in mine), max(d.lost for d in mine)
        words = f"{heading(organ)}: {count} members judged"
        words += f", up to {lost} failed runs per body (its line ends below 1)" if lost else ""
        if count < ENOUGH:
            words += (
                f"; too few to bound 95 % of all by their worst with 95 % confidence ({100 * (1 - BOUND**count):.0f} %)"
            )
        notes.append(words + ".")
    return notes


draw = drawing(figure)
