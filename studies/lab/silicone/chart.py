"""The silicone beam: measured and predicted sag, frequency and damping over the tip load."""

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import PercentFormatter

from studies.lab.silicone.cylinder import CONTESTANTS, COULOMB, FINER, REFERENCE, SLIDES
from studies.plots.style.page import blank, finish, page, panels
from studies.plots.style.style import BLACK, BLUE, GREEN, GREY, MUTED, ORANGE, PURPLE, SKY, VERMILLION, styled

TITLE = "A silicone beam let go: E and damping fitted without a load, the rest predicted"
LOOKS = tuple(zip((BLUE, SKY, GREEN, ORANGE, PURPLE, GREY, BLACK, *MUTED[:3]), "os^vDsXP*<", strict=True))
MEASURED = "measured"
REACH = {"sag": 6.0, "frequency": 15.0}
"""Half the range of the axes, sag [mm] and frequency [%]; notes name the values beyond."""


class Point(NamedTuple):
    """One row of the table: the values of one source at one load."""

    who: str
    newton: float
    """Tip load [N]."""
    sag: float
    """Mean sag of the three markers [mm]."""
    frequency: float
    """Frequency [Hz]."""
    damping: float
    """Damping ratio: damping over critical damping [1]."""


class Bar(NamedTuple):
    """A measurement: its mean and its uncertainty."""

    newton: float
    value: float
    uncertainty: float


@styled
def figure(rows: Sequence[Point], bars: Mapping[str, Sequence[Bar]]) -> Figure:
    """A panel for each of the three quantities in `bars`: "sag" [mm], "frequency" [Hz], "damping" [1].

    The panels of sag and frequency show differences from the measurement, [mm] and [%]; that of damping shows values.
    """
    if not rows:
        return blank(TITLE, "nothing is predicted yet")
    sheet = page(11, 4.2)
    labels = {
        "sag": "sag, off by [mm]",
        "frequency": "frequency, off by [%]",
        "damping": "damping ratio [1]",
    }
    names = list(dict.fromkeys(row.who for row in rows if row.who != MEASURED))
    looks = dict(zip(names, itertools.cycle(LOOKS), strict=False))
    beyond = list[str]()
    for axes, (quantity, measured) in zip(panels(sheet, 1, 3)[0], bars.items(), strict=True):
        beyond += _draw(axes, quantity, rows, measured, looks)
        axes.set(xlabel="tip load [N]", ylabel=labels[quantity])
        axes.margins(x=0.12)
    handles = [
        Line2D(
            [], [], color=VERMILLION, marker="_", markersize=11, linestyle="", label="measured, with its uncertainty"
        ),
        *(Line2D([], [], color=c, marker=m, markersize=6, label=name) for name, (c, m) in looks.items()),
    ]
    return finish(sheet, TITLE, handles, beyond, columns=3)


def _draw(
    axes: Axes, quantity: str, rows: Sequence[Point], bars: Sequence[Bar], looks: Mapping[str, tuple[str, str]]
) -> list[str]:
    """Draws measurement and predictions of one quantity; returns a note on each prediction outside the axes."""
    truth = {bar.newton: bar.value for bar in bars}

    def shown(newton: float, value: float) -> float:
        if quantity == "damping":
            return value
        return value - truth[newton] if quantity == "sag" else 100.0 * (value / truth[newton] - 1.0)

    for bar in bars:
        middle = shown(bar.newton, bar.value)
        reach = shown(bar.newton, bar.value + bar.uncertainty) - middle
        axes.errorbar(
            bar.newton, middle, reach, color=VERMILLION, marker="_", markersize=11, capsize=6, linewidth=2, zorder=3
        )
    beyond, limit = [], REACH.get(quantity)
    for name, (colour, marker) in looks.items():
        x = [row.newton for row in rows if row.who == name]
        y = [shown(row.newton, float(getattr(row, quantity))) for row in rows if row.who == name]
        axes.plot(x, y, color=colour, marker=marker, markersize=6, linewidth=1.0)
        unit = "mm" if quantity == "sag" else "%"
        beyond += [
            f"Outside the axes: {name}, {load:.2g} N, {quantity} {off:+.0f} {unit}."
            for load, off in zip(x, y, strict=True)
            if limit is not None and abs(off) > limit
        ]
    if limit is not None:
        axes.set_ylim(-limit, limit)
    return beyond


PRESS_TITLE = "Silicone cylinders under a plate: two numbers fitted between 5 and 20 %, the force beyond predicted"
OF_FAMILY = (GREEN, ORANGE, PURPLE)
OF_BODIES = {CONTESTANTS[0].name: SKY, FINER: BLUE, SLIDES: GREY}


@styled
def press_figure(
    curves: pd.DataFrame, measured: pd.DataFrame, scatter: pd.DataFrame, errors: Mapping[str, pd.DataFrame]
) -> Figure:
    """Force over that of plates that slide, `curves` beside `measured` (a column by material, rows of `compression`);
    and medians of `errors` [%] beside those of `scatter` [%] (columns of compressions)."""
    sheet = page(12, 5)
    left, right = panels(sheet, 1, 2)[0]
    names = dict.fromkeys(name.split("_")[0] for name in measured)
    families = dict(zip(names, itertools.cycle(OF_FAMILY), strict=False))
    for name in measured:
        left.plot(measured.index, measured[name], color=families[name.split("_")[0]], linewidth=0.8)
    left.plot(curves["compression"], curves[REFERENCE], color=BLACK, linewidth=2.5)
    for name, colour in OF_BODIES.items():
        left.plot(curves["compression"], curves[name], color=colour, linewidth=1.3, linestyle="--")
    rubbed = dict(zip(COULOMB.values(), (":", "-."), strict=True))
    for name, dots in rubbed.items():
        left.plot(curves["compression"], curves[name], color=VERMILLION, linewidth=1.3, linestyle=dots)
    left.set(xlabel="compression", ylabel="force / force of plates that slide [1]", ylim=(0.95, 1.7))
    for (name, table), (colour, marker) in zip(errors.items(), LOOKS, strict=False):
        right.plot(table.columns, table.abs().median(), color=colour, marker=marker, linewidth=1.3, label=name)
    right.plot(scatter.columns, scatter.median(), color=VERMILLION, linewidth=2.5, label="scatter of ten runs")
    right.set(xlabel="compression", ylabel="median error on sample B [%]", ylim=(0.0, None))
    for axes in (left, right):
        axes.xaxis.set_major_formatter(PercentFormatter(1.0, 0))
    handles = [
        *(Line2D([], [], color=colour, label=f"measured, {name}") for name, colour in families.items()),
        Line2D([], [], color=BLACK, linewidth=2.5, label="reference, plates stick"),
        *(Line2D([], [], color=colour, linestyle="--", label=name) for name, colour in OF_BODIES.items()),
        *(Line2D([], [], color=VERMILLION, linestyle=dots, label=name) for name, dots in rubbed.items()),
        *right.lines,
    ]
    return finish(sheet, PRESS_TITLE, handles, columns=3)
