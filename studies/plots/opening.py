"""How far an incision gapes from its front to its mouth, and the reference."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.base.counting import heading
from studies.metrics.run import Run, by_scene
from studies.metrics.table import metric
from studies.plots.style.bodies import BodyLook, body_looks, body_method_handles
from studies.plots.style.page import (
    band_handle,
    blank,
    finish,
    grouped,
    panel_grid,
    reference_handle,
    remarks,
    unresolved_mark,
    unresolved_notes,
)
from studies.plots.style.style import BLACK, GREY, save, styled
from studies.runs.recipes import BodyRecipe
from studies.store.schema import COMPARABLE

TITLE = "Opening of the incision against the reference"
OPENING = metric("opening_error")
COLUMNS = 2
BINS = 8
"""Intervals of depth between front and mouth in which the opening is averaged by area."""
MM = 1e3
SHUT = 1e-3
"""Opening over the size of the body below which an incision counts as shut."""


def gapes(run: Run) -> bool:
    if not fronts(run) or run.record.status not in COMPARABLE:
        return False
    return float(run.gap(run.opening).max()) > SHUT * run.size


def fronts(run: Run) -> list[int]:
    """The indices of the cuts of its scene that have a front, that is, end inside the organ."""
    return [k for k, cut in enumerate(run.case.scene.cuts) if cut.within is not None]


@styled
def figure(runs: Sequence[Run]) -> Figure:
    shown = [run for run in runs if gapes(run)]
    if not shown:
        return blank(TITLE, "no run of a scene with an incision has ended yet")
    looks = body_looks(shown)
    incisions = [(group, k) for group in by_scene(shown).values() for k in fronts(group[0])]
    sheet, axes = panel_grid(len(incisions), COLUMNS, (5.4, 3.6), (0.4, 0.3))
    for panel, (group, k) in zip(axes.flat, incisions, strict=False):
        _draw_cut(panel, group, k, looks)
    handles = [*body_method_handles(shown, looks), reference_handle(linestyle="-", linewidth=1)]
    handles.append(band_handle("± its uncertainty"))
    notes = ["Across the cut along its normal, at the last checkpoint, averaged over stretches of equal depth."]
    return finish(sheet, TITLE, handles, [*notes, *remarks(runs), *unresolved_notes(shown, (OPENING,))], columns=3)


def _draw_cut(axes: Axes, group: Sequence[Run], number: int, looks: dict[BodyRecipe, BodyLook]) -> None:
    scene = group[0].case.scene
    finest = max(group, key=lambda run: len(run.cut_pairs))
    for same in grouped(group, lambda run: (run.case.body, run.case.method.name)):
        run = same[0]
        look = looks[run.case.body]
        axes.plot(*_profile(run, run.opening, number), color=look.colour(run.case.method.name), linestyle=look.line)
    if finest.reference is not None:
        truth = finest.reference.opening(finest.fields.rest[finest.cut_pairs[:, 0]])
        depth, opening = _profile(finest, truth, number)
        spread = finest.reference.total_uncertainty["opening"] * opening
        axes.fill_between(depth, opening - spread, opening + spread, color=GREY, alpha=0.3, linewidth=0)
        axes.plot(depth, opening, color=BLACK, linewidth=1, marker="o", markeredgecolor="white")
    axes.set(xlim=(0, None), ylim=(0, None), xlabel="distance from the front [mm]", ylabel="opening [mm]")
    which = f", {scene.cuts[number].name}" if len(scene.cuts) > 1 else ""
    axes.set_title(heading(scene.name) + which + unresolved_mark(group, (OPENING,)))


def _profile(run: Run, opening: np.ndarray, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean distance from the front of a cut [mm] and mean opening [mm] in each interval that has nodes.

    opening: (p, 3) [m] of all pairs of cut nodes; number: index of the cut.
    """
    within, here = run.case.scene.cuts[number].within, run.cut_of_pairs == number
    assert within is not None  # fronts() has checked
    depth = -within.level(run.fields.rest[run.cut_pairs[here, 0]])
    gap, weights = run.gap(opening)[here], run.cut_weights[here]
    place = np.minimum((BINS * depth / depth.max()).astype(int), BINS - 1)
    share, moment, sums = (np.bincount(place, weights=weights * values, minlength=BINS) for values in (1.0, depth, gap))
    used = share > 0
    return MM * moment[used] / share[used], MM * sums[used] / share[used]


def draw(runs: Sequence[Run], path: Path) -> None:
    """Writes the chart as PNG. Raises StudyError if it cannot be written."""
    save(figure(runs), path)
