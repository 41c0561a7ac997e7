"""The uncertainty of each quantity of each reference, and its shares."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from studies.base.counting import heading, readable
from studies.plots.style.page import blank, finish, log_axis, panel_grid
from studies.plots.style.style import BLUE, GREEN, LIGHT, ORANGE, PURPLE, SMALL, VERMILLION, drawing, styled
from studies.reference.uncertainty import Uncertainty

TITLE = "Uncertainty of the references"
LOOKS = {
    "mesh": (BLUE, "o"),
    "contact": (VERMILLION, "s"),
    "kappa": (GREEN, "^"),
    "steps": (ORANGE, "D"),
    "edge": (PURPLE, "v"),
}
"""Colour and marker of each share."""
WORDS = {
    "mesh": "mesh (finest three)",
    "contact": "contact (penalty × 3)",
    "kappa": "bulk modulus (× 10)",
    "steps": "load steps (halved)",
    "edge": "elements at held edges",
}
LOWEST = 1e-4
"""Smaller shares are drawn here [%]; they do not matter."""
PERCENT = 100.0


@styled
def figure(uncertainties: Mapping[str, Mapping[str, Uncertainty]]) -> Figure:
    """One panel per scene, a row per quantity: its shares, and a bar up to the total, the root of their sum of squares.

    uncertainties: scene -> quantity -> its uncertainty. All panels have the same rows; a row stays empty if the scene
    does not have the quantity.
    """
    if not uncertainties:
        return blank(TITLE, "no reference has been solved on its family of meshes yet")
    sheet, axes = panel_grid(len(uncertainties), 2, (5.2, 2.9), (0.0, 0.3), sharex=True, sharey=True)
    longest_first = sorted(uncertainties.values(), key=len, reverse=True)
    names = list(dict.fromkeys(name for quantities in longest_first for name in quantities))
    for panel, (scene, quantities) in zip(axes.flat, uncertainties.items(), strict=False):
        panel.set_title(heading(scene))
        _draw(panel, names, quantities)
    top = max(PERCENT * u.total for quantities in uncertainties.values() for u in quantities.values())
    log_axis(axes[0, 0].xaxis)
    axes[0, 0].set_xlim(0.5 * LOWEST, 3 * max(top, LOWEST))
    axes[0, 0].invert_yaxis()
    for panel in axes.flat[: len(uncertainties)][-axes.shape[1] :]:  # the lowest of each column
        panel.set_xlabel("relative uncertainty [%]")
        panel.tick_params(labelbottom=True)
    return finish(sheet, TITLE, _handles(), _notes(uncertainties), columns=3)


def _draw(axes: Axes, names: Sequence[str], quantities: Mapping[str, Uncertainty]) -> None:
    for quantity, uncertainty in quantities.items():
        row = names.index(quantity)
        total = PERCENT * uncertainty.total
        axes.plot([0.5 * LOWEST, max(total, LOWEST)], [row, row], color=LIGHT, linewidth=9, solid_capstyle="butt")
        for name, share in uncertainty.shares.items():
            colour, marker = LOOKS[name]
            face = colour if name != "mesh" or uncertainty.order == uncertainty.order else "white"
            at = max(PERCENT * share, LOWEST)
            axes.plot(at, row, marker=marker, color=colour, markerfacecolor=face, markersize=7, markeredgewidth=1.5)
        place = {"xytext": (7, 0), "textcoords": "offset points", "va": "center", "size": SMALL}
        axes.annotate(f"{total:.2g}", (max(total, LOWEST), row), **place)
    axes.set_yticks(range(len(names)), [readable(name) for name in names])
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")


def _handles() -> list:
    shares = [
        Line2D([], [], color=colour, marker=marker, linestyle="", markersize=7, label=WORDS[name])
        for name, (colour, marker) in LOOKS.items()
    ]
    hollow = {"marker": "o", "color": BLUE, "markerfacecolor": "white", "linestyle": "", "markersize": 7}
    bar = Line2D([], [], color=LIGHT, linewidth=9, label="all together, number in %")
    return [*shares, Line2D([], [], label="mesh, no order observed", **hollow), bar]


def _notes(uncertainties: Mapping[str, Mapping[str, Uncertainty]]) -> list[str]:
    orders = [u.order for quantities in uncertainties.values() for u in quantities.values() if u.order == u.order]
    ends = list(dict.fromkeys(f"{end(orders):.2g}" for end in (np.min, np.max))) if orders else []
    seen = f" Observed {'order' if len(ends) == 1 else 'orders'} {' to '.join(ends)}." if ends else ""
    return [
        "Bar: root of the sum of the squares of the shares; the other charts show it as the uncertainty. Settings are "
        f"changed on the coarsest mesh. Shares below {LOWEST:g} % are drawn there.{seen}"
    ]


draw = drawing(figure)
