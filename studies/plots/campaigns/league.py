"""The profiles of the league: the share of all (scene, quantity) pairs that an engine solves within a budget."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from studies.plots.style.page import blank, finish, log_axis, page, panels
from studies.plots.style.style import (
    BLACK,
    BLUE,
    GREEN,
    MUTED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    drawing,
    styled,
)

TITLE = "What an engine solves within a budget: up and to the left is better"
SPARE = tuple(
    zip((ORANGE, GREEN, BLUE, PURPLE, BLACK, MUTED[2], MUTED[1], MUTED[0], SKY, VERMILLION), "^sDvX<>hP*", strict=True)
)
"""Colours and markers of the engines, in the order of appearance."""
Steps = Sequence[tuple[float, float]]


@dataclass(frozen=True)
class Profiles:
    """(budget, share) of every engine for each kind of budget and each tolerance."""

    tolerances: tuple[str, ...]
    """Tolerances in words, one per column."""
    budgets: tuple[str, ...]
    """Labels of the horizontal axes, one per row."""
    of: Mapping[str, Mapping[tuple[int, int], Steps]]
    """Engine -> (row, column) -> (budget, share) of each step, in rising order."""
    notes: tuple[str, ...] = ()


@styled
def figure(shown: Profiles) -> Figure:
    """A row for each kind of budget, a column for each tolerance."""
    if not any(steps for parts in shown.of.values() for steps in parts.values()):
        return blank(TITLE, "no entry is within a tolerance yet")
    sheet = page(3.6 * len(shown.tolerances) + 0.6, 3.1 * len(shown.budgets))
    axes = panels(sheet, len(shown.budgets), len(shown.tolerances), sharey=True, sharex="row")
    looks = {name: SPARE[number % len(SPARE)] for number, name in enumerate(shown.of)}
    for (name, parts), number in zip(shown.of.items(), range(len(shown.of)), strict=True):
        colour, marker = looks[name]
        line = "-" if number < len(SPARE) else "--"
        for (row, column), steps in parts.items():
            if steps:
                x, y = zip(*steps, strict=True)
                axes[row, column].step((x[0], *x), (0.0, *y), where="post", color=colour, linestyle=line)
                axes[row, column].plot(x[-1], y[-1], color=colour, marker=marker)
    for row, words in enumerate(shown.budgets):
        for column, tolerance in enumerate(shown.tolerances):
            axes[row, column].set_xscale("log")
            axes[row, column].set_xlabel(words)
            if row == 0:
                axes[row, column].axvline(1.0, color=BLACK, linewidth=1.2)
                axes[row, column].set_title(tolerance)
        axes[row, 0].set_ylim(0.0, 1.05)
        axes[row, 0].set_ylabel("share of the pairs")
        log_axis(axes[row, 0].xaxis)
    handles = [
        Line2D([], [], color=colour, marker=marker, linestyle="-" if n < len(SPARE) else "--", label=name)
        for n, (name, (colour, marker)) in enumerate(looks.items())
    ]
    handles.append(Line2D([], [], color=BLACK, linewidth=1.2, label="real time"))
    return finish(sheet, TITLE, handles, shown.notes, columns=4)


draw = drawing(figure)
