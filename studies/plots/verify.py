"""Convergence of the reference: error over mesh size, and the effect of kappa/mu on results."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from reference_fem.oracles import Curve
from studies.plots.style.page import blank, finish, page, panels
from studies.plots.style.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, drawing, save, styled

TITLE = "The reference against known answers: error over mesh size"
COLOURS, MARKERS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY), "osD^vP"


@styled
def figure(curves: Sequence[Curve]) -> Figure:
    if not curves:
        return blank(TITLE, "no oracle of this run was solved on several meshes")
    names = list(dict.fromkeys(curve.panel for curve in curves))
    sheet = page(4.6 * len(names), 5.0)
    for axes, name in zip(panels(sheet, 1, len(names))[0], names, strict=True):
        chosen = [curve for curve in curves if curve.panel == name]
        for k, curve in enumerate(chosen):
            _draw_curve(axes, curve, k)
        axes.set_title(name[:1].upper() + name[1:])
        axes.set_xlabel("element size over body size [1]")
        axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.2), borderaxespad=0.0)
        _log_log(axes, chosen)
    axes = sheet.axes[0]
    axes.set_ylabel("relative error [1]")
    notes = [
        "After each name: order of convergence between the two finest meshes; with contact it need not be steady.",
        "Manufactured solution: relative L2 errors.",
    ]
    return finish(sheet, TITLE, [], notes)


def _draw_curve(axes: Axes, curve: Curve, number: int) -> None:
    colour, marker = COLOURS[number % len(COLOURS)], MARKERS[number % len(MARKERS)]
    label = f"{curve.label}: {curve.order:.2f}"
    axes.plot(curve.sizes, curve.errors, color=colour, marker=marker, markersize=6, label=label)


def _log_log(axes: Axes, curves: Sequence[Curve]) -> None:
    axes.set(xscale="log", yscale="log")
    ticks = sorted({size for curve in curves for size in curve.sizes})
    kept: list[float] = []
    for size in ticks:
        if not kept or size > 1.25 * kept[-1]:  # closer labels would touch
            kept.append(size)
    axes.set_xticks(kept)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"1/{1.0 / value:.3g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


draw = drawing(figure)


@styled
def kappa_figure(ratios: np.ndarray, rows: dict[str, np.ndarray]) -> Figure:
    """Absolute relative difference from the result of the largest kappa/mu, over kappa/mu: one line per quantity.

    ratios (n,): kappa/mu [1] in rising order; rows: quantity -> its values (n,).
    """
    sheet = page(8.0, 4.6)
    axes = sheet.subplots()
    handles = []
    for k, (name, values) in enumerate(rows.items()):
        change = np.abs(values[:-1] / values[-1] - 1.0)
        colour, marker = COLOURS[k % len(COLOURS)], MARKERS[k % len(MARKERS)]
        axes.plot(ratios[:-1], change, color=colour, marker=marker, markersize=6)
        handles.append(Line2D([], [], color=colour, marker=marker, label=name))
    low, high = ratios[0], ratios[-2]
    first = max(abs(values[0] / values[-1] - 1.0) for values in rows.values())
    axes.plot([low, high], [first, first * low / high], color=GREY, linestyle=":", linewidth=1.4)
    handles.append(Line2D([], [], color=GREY, linestyle=":", linewidth=1.4, label="slope -1"))
    axes.axvline(5000.0, color=BLACK, linewidth=1.0)
    axes.annotate(
        "scenes", (5000.0, 1.0), xycoords=("data", "axes fraction"), xytext=(4, -12), textcoords="offset points"
    )
    axes.set(xscale="log", yscale="log", xlabel="bulk over shear modulus, kappa/mu [1]")
    axes.set_ylabel(f"relative change from {ratios[-1]:,.0f} [1]")
    return finish(sheet, "Effect of a finite bulk modulus", handles, columns=2)


def draw_kappa(ratios: np.ndarray, rows: dict[str, np.ndarray], path: Path) -> None:
    """Writes the chart of `kappa_figure` as PNG. Raises StudyError if it cannot be written."""
    save(kappa_figure(ratios, rows), path)
