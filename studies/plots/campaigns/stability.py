"""Where a method breaks: status over time step and stiffness, with the theoretical limit."""

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from studies.base.counting import heading, readable
from studies.metrics.run import Run
from studies.plots.style.bodies import body_looks
from studies.plots.style.page import blank, finish, grouped, log_axis, panel_grid
from studies.plots.style.style import BLACK, STATUS_LOOKS, drawing, method_label, styled
from studies.store.record import Status

TITLE = "Stability: time step × stiffness"
TITLE_LETTERS = 52
"""Letters in a line of the title of a panel."""
MS = 1e3


@styled
def figure(runs: Sequence[Run]) -> Figure:
    placed = [run for run in runs if "dt" in run.record.attributes]
    if not placed:
        return blank(TITLE, "no run yet")
    looks = body_looks(placed, ignored=("stiffness",))
    groups = grouped(placed, lambda run: (run.case.scene.name, looks[run.case.body], run.case.method.name))
    sheet, axes = panel_grid(len(groups), 2, (5.2, 3.5), (0.6, 0.3), sharey=True)
    for panel, group in zip(axes.flat, groups, strict=False):
        _draw_map(panel, group)
        panel.set_title(_title(group[0], looks[group[0].case.body].name))
    for left in axes[:, 0]:
        left.set_ylabel("stiffness factor [1]")
    for right in [*axes[:-1, -1], axes.flat[len(groups) - 1]]:
        _modulus_axis(right, groups[0])
    lost = [f"{run.case.name}: {run.record.message}." for run in runs if "dt" not in run.record.attributes]
    return finish(sheet, TITLE, _handles(placed), [*_size_of(placed), *lost], columns=4)


def _draw_map(axes: Axes, group: Sequence[Run]) -> None:
    dt = np.array([MS * run.attributes.dt for run in group])
    factor = np.array([run.case.body.stiffness for run in group])
    edges_x, edges_y = _edges(dt), _edges(factor)
    for run, x, y in zip(group, dt, factor, strict=True):
        colour, marker = STATUS_LOOKS[run.record.status]
        (left, right), (low, high) = edges_x[float(x)], edges_y[float(y)]
        # The marker repeats the information of the colour.
        axes.add_patch(Rectangle((left, low), right - left, high - low, color=colour, alpha=0.22, linewidth=0))
        axes.plot(x, y, marker=marker, color=colour, linestyle="", markersize=8, markeredgecolor="white")
    _draw_limit(axes, group)
    for axis in (axes.xaxis, axes.yaxis):
        log_axis(axis)
    axes.set_yticks(sorted(edges_y), [f"{value:g}" for value in sorted(edges_y)])
    axes.minorticks_off()
    ticks = [
        tick for tick in (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50) if dt.min() <= 1.01 * tick and tick <= 1.01 * dt.max()
    ]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xlim(min(low for low, _ in edges_x.values()), max(high for _, high in edges_x.values()))
    axes.set_ylim(min(low for low, _ in edges_y.values()), max(high for _, high in edges_y.values()))
    axes.grid(visible=False)
    axes.set_xlabel("time step dt [ms]")


def _title(run: Run, body: str) -> str:
    """Scene, body and method, in lines of up to TITLE_LETTERS."""
    return textwrap.fill(f"{heading(run.case.scene.name)}, {body}, {method_label(run.case.method.name)}", TITLE_LETTERS)


def _edges(values: np.ndarray) -> dict[float, tuple[float, float]]:
    """Value -> borders of its cell, half way to its neighbours on a logarithmic axis."""
    unique = np.log(np.unique(values))
    step = np.diff(unique) if len(unique) > 1 else np.array([np.log(2.0)])
    middle = unique[:-1] + np.diff(unique) / 2
    borders = np.exp(np.concatenate([[unique[0] - step[0] / 2], middle, [unique[-1] + step[-1] / 2]]))
    return {
        float(v): (float(a), float(b)) for v, a, b in zip(np.unique(values), borders[:-1], borders[1:], strict=True)
    }


def _draw_limit(axes: Axes, group: Sequence[Run]) -> None:
    """Draws the largest stable step [ms] of each stiffness, from the largest frequency of the springs at rest."""
    limits = {run.case.body.stiffness: MS * run.attributes.dt_limit for run in group}
    factor = np.array(sorted(limits))
    dt = np.array([limits[value] for value in factor])
    white = {"color": "white", "linewidth": 5, "alpha": 0.8}
    axes.plot(dt, factor, **white)
    axes.plot(dt, factor, color=BLACK, linewidth=2, marker=".", markersize=7)


def _modulus_axis(axes: Axes, group: Sequence[Run]) -> None:
    """Adds an axis on the right for the stiffness as the shear modulus that the springs match [kPa]."""
    modulus = group[0].case.scene.tissue.shear_modulus / 1e3
    there, back = (lambda factor: modulus * np.asarray(factor)), (lambda value: np.asarray(value) / modulus)
    twin = axes.secondary_yaxis("right", functions=(there, back))
    factors = sorted({run.case.body.stiffness for run in group})
    twin.set_yticks([modulus * factor for factor in factors], [f"{modulus * factor:.3g}" for factor in factors])
    twin.minorticks_off()
    twin.set_ylabel("shear modulus matched [kPa]")


def _handles(placed: Sequence[Run]) -> list:
    statuses = {run.record.status for run in placed}
    marks = [
        Line2D([], [], marker=marker, color=colour, linestyle="", markersize=9, label=readable(status))
        for status, (colour, marker) in STATUS_LOOKS.items()
        if status in statuses
    ]
    limit = Line2D([], [], color=BLACK, linewidth=2, marker=".", label="theoretical limit at rest")
    return [*marks, limit]


def _size_of(placed: Sequence[Run]) -> list[str]:
    nodes = sorted({run.case.body.nodes for run in placed})
    below = [run for run in placed if run.attributes.dt < run.attributes.dt_limit]
    broken = sum(run.record.status == Status.DIVERGED for run in below)
    survived = sum(run.record.status != Status.DIVERGED for run in placed) - (len(below) - broken)
    return [
        f"{', '.join(f'{n:,}' for n in nodes)} surface nodes. Below the limit {broken} of {len(below)} runs diverge; "
        f"above it {survived} of {len(placed) - len(below)} do not."
    ]


draw = drawing(figure)
