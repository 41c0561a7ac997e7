"""Error of the force against speed for three bodies in every scene: the chart of README."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from studies.base.counting import readable
from studies.plots.style.page import finish, page, panels
from studies.plots.style.style import GREY, NORMAL, drawing, styled

TITLE = "How accurate, how fast: three bodies in the scenes whose force is known"
FORCE, SPEED = "force_end [%]", "real_time [s/s]"
PAPER, ONE = "surface", "tetrahedral"
COLOURS = {"the paper's body": "#0072B2", "one kept volume": "#D55E00", "quadratic, masses by stiffness": "#009E73"}
MARKERS = "osD^vP*X"
SMALLEST = 0.05
"""Errors below are drawn there [%]: the references know no force better."""


@styled
def figure(table: pd.DataFrame) -> Figure:
    """table: the published table of the study `accuracy`, a row for each case; timed rows are shown."""
    table = table[(table["method"] == "implicit_volume") & (table["status"] == "ok")]
    table = table.dropna(subset=[FORCE, SPEED])
    scenes = list(dict.fromkeys(table["scene"]))
    sheet = page(8.0, 4.6)
    axes = panels(sheet, 1, 1)[0][0]
    for name, colour in COLOURS.items():
        for scene, marker in zip(scenes, MARKERS, strict=False):
            row = _row(table[table["scene"] == scene], name)
            if row is not None:
                error = max(abs(row[FORCE]), SMALLEST)
                axes.plot(row[SPEED], error, marker, color=colour, markersize=7, markeredgecolor="white")
    axes.axvline(1.0, color=GREY, linewidth=1)
    axes.text(1.04, 900, "real time", color=GREY, size=NORMAL - 1, va="top")
    axes.axhline(3.0, color=GREY, linewidth=1, linestyle=(0, (1, 2)))
    axes.text(0.02, 3.0, " 3 %", color=GREY, size=NORMAL - 1, va="bottom", transform=axes.get_yaxis_transform())
    axes.set(xscale="log", yscale="log", ylim=(SMALLEST * 0.8, 1000))
    axes.set_xlabel("simulated time over computing time, one core [s/s]")
    axes.set_ylabel("error of the force at full load [%]")
    handles = [Line2D([], [], color=c, marker="s", linestyle="", label=n) for n, c in COLOURS.items()]
    handles += [
        Line2D([], [], color=GREY, marker=m, linestyle="", label=readable(s)) for s, m in zip(scenes, MARKERS, strict=False)
    ]
    return finish(sheet, TITLE, handles, ["Of each kind the finest body that was timed."])


def _row(rows: pd.DataFrame, name: str) -> "pd.Series | None":
    """The finest timed body of a kind."""
    body = rows["body"]
    chosen = {"the paper's body": body == PAPER, "one kept volume": body == ONE}.get(name, body.str.endswith(name))
    rows = rows[chosen].sort_values("nodes")
    return None if rows.empty else rows.iloc[-1]


draw = drawing(figure)
