"""Which method survives which random trials: the share of each status, and of runs that end ok over the step."""

from itertools import pairwise

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from studies.plots.style.page import blank, finish, page, panels
from studies.plots.style.style import (
    BLACK,
    GREEN,
    GREY,
    MUTED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    YELLOW,
    drawing,
    method_label,
    styled,
)

TITLE = "Which trials methods survive: random bodies, steps, starts and surroundings"
LOOKS = {
    "ok": (GREEN, ""),
    "folded": (MUTED[5], "oooo"),
    "inverted": (PURPLE, "////"),
    "tunnelled": (MUTED[7], "++++"),
    "drifted": (YELLOW, "...."),
    "penetrated": (ORANGE, "xxxx"),
    "blocked": (SKY, "----"),
    "diverged": (BLACK, ""),
    "timed-out": (GREY, "\\\\\\\\"),
    "unexplained": (VERMILLION, "++++"),
}
"""Status -> colour and hatch, which repeats the information of the colour. Refused trials are not runs."""
EDGES = 2.0 ** np.arange(-4.0, 2.1, 1.0)
"""Limits of the ranges of the step over the stability limit [1]."""
REFUSED = "refused"
FEWEST = 5
"""Fewest trials in a range for which a share is shown."""


@styled
def figure(table: pd.DataFrame) -> Figure:
    """Left: the share of each status, a bar for each method. Right: the share that ends ok, by range of the step.

    table: a row for each trial (studies.tools.fuzz.outcome.table_of).
    """
    runs = [
        row for row in zip(table["method"], table["status"], table["dt_fraction"], strict=True) if row[1] != REFUSED
    ]
    if not runs:
        return blank(TITLE, "no trial has run")
    method, status = (np.array([row[at] for row in runs]) for at in (0, 1))
    methods = sorted(set(method), key=lambda name: float(np.mean(status[method == name] == "ok")))
    sheet = page(11.0, 0.32 * len(methods) + 1.6)
    left, right = panels(sheet, 1, 2, sharey=True)[0]
    shown = [name for name in LOOKS if (status == name).any()]
    _draw_bars(left, {s: [float(np.mean(status[method == name] == s)) for name in methods] for s in shown})
    left.set_yticks(range(len(methods)), [f"{method_label(name)} ({(method == name).sum()})" for name in methods])
    place = np.clip(np.digitize([row[2] for row in runs], EDGES) - 1, 0, len(EDGES) - 2)
    for row, name in enumerate(methods):
        _draw_shares(right, row, place[method == name], status[method == name] == "ok")
    _finish_shares(right)
    handles = [Patch(facecolor=LOOKS[s][0], hatch=LOOKS[s][1], edgecolor="white", label=s) for s in shown]
    notes = [
        f"{len(table):,} trials, {len(table) - len(runs):,} of them refused. In brackets: runs of a "
        "method. Dashed: the stability limit of the springs alone.",
        "Bodies with slivers and mass ratios to 1e6, flattened, mirrored or collapsed starts, targets that jump and "
        "obstacles to 10 m/s and 90 % squeeze: many trials cannot succeed. Each method gets only options that it "
        "supports: implicit_volume also many volumes, quadratic bodies and thin probes, which are harder.",
    ]
    return finish(sheet, TITLE, handles, notes, columns=4)


def _draw_bars(axes: Axes, shares: dict[str, list[float]]) -> None:
    begin = np.zeros(len(next(iter(shares.values()))))
    for name, share in shares.items():
        colour, hatch = LOOKS[name]
        width = 100.0 * np.array(share)
        axes.barh(range(len(width)), width, left=begin, color=colour, hatch=hatch, edgecolor="white", linewidth=0.5)
        begin += width
    axes.set(xlabel="share of the runs [%]", xlim=(0, 100))
    axes.grid(axis="y", visible=False)


def _draw_shares(axes: Axes, row: int, place: np.ndarray, well: np.ndarray) -> None:
    """Draws the ranges of a method, shaded from white (none end ok) to dark (all), with the share [%] in each.

    place (n,): range of each run; well (n,) bool: whether it ends ok.
    """
    for column, (low, high) in enumerate(pairwise(EDGES)):
        inside = well[place == column]
        if len(inside) < FEWEST:
            continue
        share = float(np.mean(inside))
        dark = matplotlib.colormaps["Greens"](0.85 * share)
        axes.fill_between((low, high), row - 0.45, row + 0.45, color=dark, linewidth=0)
        ink = "white" if share > 0.6 else BLACK
        middle = float(np.sqrt(low * high))
        axes.text(middle, row, f"{100 * share:.0f}", ha="center", va="center", fontsize="small", color=ink)


def _finish_shares(axes: Axes) -> None:
    axes.set(xscale="log", xlim=(EDGES[0], EDGES[-1]), xlabel="step over the stability limit [1]")
    axes.set_xticks(EDGES, [f"1/{1 / edge:g}" if edge < 1 else f"{edge:g}" for edge in EDGES], minor=False)
    axes.minorticks_off()
    axes.axvline(1.0, color=GREY, linestyle="--")
    axes.set_title("runs that end ok [%]")
    axes.grid(visible=False)


draw = drawing(figure)
