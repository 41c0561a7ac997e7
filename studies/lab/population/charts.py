"""Errors over a population: the share of members within an error, a line for each body; and the error bound of 95 of
100 members over computing time."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from studies import Metric, Run
from studies.base.counting import heading
from studies.lab.population.rows import Group, groups, rows_of
from studies.lab.population.tables import FEW
from studies.metrics.cells import DISTURBED_NOTE
from studies.metrics.distribution import BOUND, ENOUGH, columns_of
from studies.metrics.table import DISTURBED, PROCESSOR, metric
from studies.metrics.wish import usual_wish
from studies.plots.style.families import family_of
from studies.plots.style.page import band_handle, blank, finish, log_axis, page, panels
from studies.plots.style.style import GREEN, GREY, SMALL, drawing, remark, styled

FRONT = "What the error of 95 of 100 random organs costs in computing time"
TITLE = "Randomly generated organs: share of a population within an error"
SHOWN = {"force_end": "error of the force [%]", "mean_error": "mean error / largest u [%]"}
NO_FORCE = "the scenes compare no force"
SPEED = "real_time [s/s]"
LOWEST = 0.02
"""Smaller errors are drawn here [%]."""
STYLES = ("-", (0, (4, 1.6)), (0, (1, 1.2)))
"""Lines of the bodies of one family, in the order of appearance."""


@styled
def figure(groups: Sequence[Group]) -> Figure:
    """A column for each organ, a row for each metric."""
    all_groups = _judged(groups)
    organs = list(dict.fromkeys(group.organ for group in all_groups))
    if not organs:
        return blank(TITLE, "no member has been judged yet")
    sheet = page(3.9 * len(organs) + 0.8, 6.4)
    axes = panels(sheet, len(SHOWN), len(organs), sharey=True, sharex="row")
    handles: dict[str, Line2D] = {}
    for column, organ in zip(axes.T, organs, strict=True):
        mine = [group for group in all_groups if group.organ == organ]
        column[0].set_title(f"{heading(organ)} ({pd.concat([group.rows for group in mine])['scene'].nunique()})")
        for panel, (name, label) in zip(column, SHOWN.items(), strict=True):
            handles |= _draw(panel, mine, metric(name))
            panel.set_xlabel(label)
            log_axis(panel.xaxis)
            panel.set_ylim(0.0, 1.02)
    for panel in axes[:, 0]:
        panel.set_ylabel("share of the members")
    legend = [*handles.values(), band_handle("uncertainty of the references, smallest to largest")]
    return finish(sheet, TITLE, legend, _notes(all_groups), columns=3)


def _judged(groups: Sequence[Group]) -> list[Group]:
    return [group for group in groups if _errors(group, metric("mean_error"))]


def _errors(group: Group, entry: Metric) -> list[float]:
    """Absolute errors [%] of the members that were judged, at least LOWEST, in rising order."""
    return sorted(columns_of(group.rows, entry)[0].abs().clip(lower=LOWEST).dropna())


def _draw(panel: Axes, mine: Sequence[Group], entry: Metric) -> dict[str, Line2D]:
    """Draws the lines of one panel; returns name of each body -> its legend entry."""
    handles, sizes = {}, dict[str, int]()
    panel.axhline(BOUND, color=GREY, linewidth=1.0, linestyle=(0, (1.5, 2)))
    panel.text(
        0.015, BOUND - 0.015, "95 of 100", transform=panel.get_yaxis_transform(), size=SMALL, color=GREY, va="top"
    )
    floors = [floor for group in mine for floor in columns_of(group.rows, entry)[1].dropna()]
    if floors:
        panel.axvspan(max(min(floors), LOWEST), max(floors), color=GREY, alpha=0.2, linewidth=0)
    for group in mine:
        errors = _errors(group, entry)
        if not errors:
            continue
        look = family_of(group.case)
        style = STYLES[min(sizes.setdefault(look.name, 0), len(STYLES) - 1)]
        sizes[look.name] += 1
        share = np.arange(1, len(errors) + 1) / len(group.rows)
        panel.step(errors, share, where="post", color=look.colour, linestyle=style, linewidth=1.7)
        label = f"{look.name}, {group.case.body.nodes} nodes"
        handles[label] = Line2D([], [], color=look.colour, linestyle=style, linewidth=1.7, label=label)
    if not handles:
        remark(panel, NO_FORCE)
    return handles


def _notes(all_groups: Sequence[Group]) -> list[str]:
    notes = []
    for organ in dict.fromkeys(group.organ for group in all_groups):
        mine = [group.of(metric("mean_error")) for group in all_groups if group.organ == organ]
        count, lost = max(d.count for d in mine), max(d.lost for d in mine)
        words = f"{heading(organ)}: {count} members judged"
        words += f", up to {lost} failed runs per body (its line ends below 1)" if lost else ""
        if count < ENOUGH:
            words += (
                f"; too few to bound 95 % of all by their worst with 95 % confidence ({100 * (1 - BOUND**count):.0f} %)"
            )
        notes.append(words + ".")
    return notes


@styled
def front(groups: Sequence[Group]) -> Figure:
    """Error of 95 of 100 members over computing time; a column for each organ, a row for each metric."""
    costs = {group: cost for group in _judged(groups) if (cost := _cost(group)) == cost}
    all_groups = list(costs)
    organs = list(dict.fromkeys(group.organ for group in all_groups))
    if not organs:
        return blank(FRONT, "no frame times from this machine and this code yet")
    sheet = page(3.4 * len(organs) + 0.8, 6.4)
    axes = panels(sheet, len(SHOWN), len(organs), sharey="row", sharex=True)
    handles: dict[str, Line2D] = {}
    for column, organ in zip(axes.T, organs, strict=True):
        mine = [group for group in all_groups if group.organ == organ]
        column[0].set_title(f"{heading(organ)} ({max(len(group.rows) for group in mine)})")
        for panel, name in zip(column, SHOWN, strict=True):
            handles |= _draw_front(panel, [(costs[group], group) for group in mine], metric(name))
    for panel, label in zip(axes[:, 0], SHOWN.values(), strict=True):
        panel.set_ylabel(f"95 of 100 members:\n{label}")
        log_axis(panel.yaxis)
    for row, name in zip(axes, SHOWN, strict=True):
        bounds = [bound for group in all_groups if (bound := group.of(metric(name)).bound) == bound]
        row[0].set_ylim(min(bounds) / 3.0, 6.0 * max(bounds))  # labels stand above the points
    for panel in axes[-1]:
        panel.set_xlabel("computing time / simulated time [s/s]")
    axes[-1, 0].set_xlim(min(costs.values()) / 2.0, 2.0 * max(1.0, *costs.values()))
    log_axis(axes[-1, 0].xaxis)
    notes = [
        "Bars: 95 % confidence from resampling the members. Numbers: surface nodes. Green: within the target in real "
        "time. Computing time is that of the first member of each organ.",
        *timing_notes(all_groups),
    ]
    if min(len(group.rows) for group in all_groups) < FEW:
        notes.append(f"Of fewer than {FEW} members the error of 95 of 100 lies between those of the two worst.")
    return finish(sheet, FRONT, list(handles.values()), notes, columns=3)


def _cost(group: Group) -> float:
    """Median of computing time over simulated time [1] of the members that were timed; NaN without one."""
    speeds = group.rows[SPEED].dropna()
    return 1.0 / float(np.median(speeds)) if len(speeds) else float("nan")


def timing_notes(groups: Sequence[Group]) -> list[str]:
    rows = pd.concat([group.rows for group in groups]).reindex(columns=["scene", PROCESSOR, DISTURBED])
    texts = rows.astype(object).where(rows.notna(), "")  # a row without a time, or a column that a table lacks
    names = [name for name in texts[PROCESSOR].unique() if name]
    disturbed = texts.loc[texts[DISTURBED] != "", "scene"].unique()
    notes = [f"Wall times of {', '.join(names)}."] if names else []
    return [*notes, *([f"{DISTURBED_NOTE}: {', '.join(disturbed)}."] if len(disturbed) else [])]


def _draw_front(panel: Axes, bodies: Sequence[tuple[float, Group]], entry: Metric) -> dict[str, Line2D]:
    """Draws the points of one panel, (cost, group) each; returns name of each family -> its legend entry."""
    wish = usual_wish(bodies[0][1].case.scene)
    bound = wish.force if entry.name == "force_end" else wish.displacement
    handles = {}
    for cost, group in bodies:
        error, look = group.of(entry), family_of(group.case)
        if not error.count:
            continue
        low, high = (abs(end - error.bound) for end in error.bound_interval)
        bar = [[low], [high]] if low == low else None
        panel.errorbar(cost, error.bound, yerr=bar, marker=look.marker, color=look.colour, capsize=2, linestyle="none")
        nodes, top = str(group.case.body.nodes), error.bound_interval[1] if bar else error.bound
        panel.annotate(
            nodes, (cost, top), (0, 5), textcoords="offset points", size=SMALL, color=GREY, rotation=90, ha="center"
        )
        handles[look.name] = Line2D([], [], marker=look.marker, color=look.colour, linestyle="none", label=look.name)
    if not handles:
        remark(panel, NO_FORCE)
        return handles
    panel.axvline(1.0, color=GREY, linewidth=1.2)
    if bound is not None:
        panel.fill_between([1e-9, 1.0], 1e-12, bound, color=GREEN, alpha=0.12, linewidth=0)
    return handles


def write(groups: Sequence[Group], folder: Path) -> None:
    """Both charts. Raises StudyError if they cannot be written."""
    drawing(figure)(groups, folder / "distributions.png")
    drawing(front)(groups, folder / "front.png")


def draw(runs: Sequence[Run], path: Path) -> None:
    drawing(figure)(_of_runs(runs), path)


def draw_front(runs: Sequence[Run], path: Path) -> None:
    drawing(front)(_of_runs(runs), path)


def _of_runs(runs: Sequence[Run]) -> list[Group]:
    return groups(rows_of(runs, [*SHOWN, "real_time"]), [run.case for run in runs])
