"""How well each piece of a cut body keeps its volume, and all pieces together."""

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from studies.base.counting import heading
from studies.metrics.run import Run
from studies.plots.style.bodies import body_looks
from studies.plots.style.page import blank, finish, good_frames, grouped, has_frames, panel_grid, remarks
from studies.plots.style.style import BLACK, BLUE, GREY, ORANGE, SMALL, drawing, styled

TITLE = "Volumes of the pieces of a body that is cut"
COLUMNS = 3
LETTERS = 34
"""Letters in a line of a name above a panel."""
LOOKS = ((BLUE, "-"), (ORANGE, (0, (5, 1.5))))
"""Colours and lines of the pieces, in turn."""
PERCENT = 100.0
SMALLEST = 1e-8
"""Bottom of the axis [%]; smaller values are rounding errors."""


def parts(run: Run) -> bool:
    return bool(run.case.scene.cuts) and has_frames(run) and len(np.unique(run.field("cut_parts"))) > 1


@styled
def figure(runs: Sequence[Run]) -> Figure:
    shown = [run for run in runs if parts(run)]
    if not shown:
        return blank(TITLE, "no run of a body that is cut in pieces has recorded a frame yet")
    groups = grouped(shown, lambda run: (run.case.scene.name, run.case.body, run.case.method.name))
    looks = body_looks(shown)
    sheet, axes = panel_grid(len(groups), COLUMNS, (3.7, 2.6), (0.4, 0.3), sharex=True, sharey=True)
    for panel, (run, *_) in zip(axes.flat, groups, strict=False):
        _draw_run(panel, run)
        name = textwrap.fill(looks[run.case.body].name, LETTERS)
        panel.set_title(f"{heading(run.case.scene.name)}\n{name}", size=SMALL)
    for lowest in axes.flat[max(0, len(groups) - axes.shape[1]) : len(groups)]:
        lowest.set_xlabel("time [s]")
        lowest.tick_params(labelbottom=True)
    for left in axes[:, 0]:
        left.set_ylabel("|V/V₀ − 1| [%]")
    most = max(len(np.unique(run.field("cut_parts"))) for run in shown)
    handles = [Line2D([], [], color=c, linestyle=s, label=f"piece {k + 1}") for k, (c, s) in enumerate(_looks(most))]
    handles.append(Line2D([], [], color=BLACK, linewidth=1.0, label="all together"))
    notes = [
        "Dotted: a cut. Before it a piece is a part of the body with no volume of its own to keep; after it each is "
        "led to its volume on one clock."
    ]
    return finish(sheet, TITLE, handles, [*notes, *remarks(shown)], columns=4)


def _looks(count: int) -> list[tuple]:
    return [LOOKS[k % len(LOOKS)] for k in range(count)]


def _draw_run(axes: Axes, run: Run) -> None:
    good = slice(0, good_frames(run))
    volume, target = run.part_volumes
    for (colour, line), of_piece, rest in zip(_looks(volume.shape[1]), volume.T, target[-1], strict=True):
        axes.plot(run.fields.t[good], _off(of_piece[good], rest), color=colour, linestyle=line)
    axes.plot(run.fields.t[good], _off(volume[good].sum(axis=1), target[-1].sum()), color=BLACK, linewidth=1.0)
    for at in sorted({at for cut in run.case.scene.cuts for at in (cut.at, cut.ends)}):
        axes.axvline(at, color=GREY, linewidth=1, linestyle=":")
    axes.set_yscale("log")
    axes.set(xlim=(0, run.case.scene.duration), ylim=(SMALLEST, PERCENT))


def _off(volume: np.ndarray, rest: float) -> np.ndarray:
    """100 |volume / rest - 1| [%], at least SMALLEST, because zero has no logarithm."""
    return np.maximum(PERCENT * np.abs(volume / rest - 1), SMALLEST)


draw = drawing(figure)
