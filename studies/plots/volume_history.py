"""How much volume each model loses over time: in per cent, and on a logarithmic axis (Figure 3 of the paper, JHC05)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from studies.base.counting import heading
from studies.metrics.run import Run, by_scene
from studies.plots.style.bodies import BodyLook, body_looks, body_method_handles
from studies.plots.style.page import (
    blank,
    finish,
    good_frames,
    grouped,
    has_frames,
    page,
    panels,
    reference_handle,
    remarks,
)
from studies.plots.style.style import BLACK, GREY, drawing, styled
from studies.store.schema import COMPARABLE

TITLE = "How much volume each model loses"
PERCENT = 100.0
SMALLEST = 1e-10
"""Bottom of the logarithmic axis [%]; smaller values are rounding errors."""
VISIBLE = 0.5
"""Largest change of a volume [%] for which no panel shows its sign."""
WIDEST = 4
"""Most scenes in a row."""


@styled
def figure(runs: Sequence[Run]) -> Figure:
    """For each scene a panel in per cent and a logarithmic one below it; the latter alone if no volume in any scene
    changes by more than VISIBLE."""
    shown = [run for run in runs if has_frames(run)]
    if not shown:
        return blank(TITLE, "no run has recorded a frame yet")
    scenes, looks = by_scene(shown), body_looks(shown)
    lowest, highest = _range(shown)
    height = 1 if max(-lowest, highest) <= VISIBLE else 2
    columns = min(len(scenes), WIDEST)
    blocks = -(-len(scenes) // columns)
    sheet = page(2.7 * columns + 0.9, 2.7 * height * blocks + 0.6)
    axes = panels(sheet, height * blocks, columns)
    for spare in range(len(scenes), blocks * columns):
        for panel in axes[-height:, spare % columns]:
            panel.set_axis_off()
    for number, (name, group) in enumerate(scenes.items()):
        top, column = height * (number // columns), number % columns
        column_axes = axes[top : top + height, column]
        column_axes[0].set_title(heading(name))
        for same in grouped(group, lambda run: (run.case.body, run.case.method.name)):
            for run in same:
                _draw_run(column_axes, run, looks[run.case.body], finer=run is not same[0])
        _draw_reference(column_axes, group[0])
        _scale(column_axes, lowest, highest, first=column == 0)
    handles = [*body_method_handles(shown, looks), reference_handle()]
    if len(shown) > len({(run.case.scene.name, run.case.body, run.case.method.name) for run in shown}):
        handles.append(Line2D([], [], color=GREY, linewidth=0.9, label="thin: the same at a smaller time step"))
    flat = [f"No volume changes by more than {VISIBLE:g} %, so only its size is drawn."] if height == 1 else []
    return finish(sheet, TITLE, handles, [*flat, *_stiffness(shown), *remarks(runs)], columns=3)


def _stiffness(shown: Sequence[Run]) -> list[str]:
    """A note on why the volume of the reference changes; [] without a reference."""
    ratios = sorted({run.case.scene.tissue.bulk_over_shear for run in shown if run.reference is not None})
    if not ratios:
        return []
    return [f"The tissue of the reference gives way a little: κ/μ = {', '.join(f'{ratio:,.0f}' for ratio in ratios)}."]


def _draw_run(axes: np.ndarray, run: Run, body: BodyLook, finer: bool) -> None:
    """Draws a run in all panels, or a `finer` one, with another step, as a thin line in the logarithmic panel only."""
    good = slice(0, good_frames(run))
    change = PERCENT * (run.volume_ratio[good] - 1)
    look = {"color": body.colour(run.case.method.name), "linestyle": body.line}
    if len(axes) > 1 and not finer:
        axes[0].plot(run.fields.t[good], change, **look)
    # Zero has no logarithm; an exact volume lies on the bottom of the axis.
    axes[-1].plot(run.fields.t[good], np.maximum(np.abs(change), SMALLEST), linewidth=0.9 if finer else 1.6, **look)


def _draw_reference(axes: np.ndarray, run: Run) -> None:
    if run.reference is None:
        return
    t, change = run.reference.field("t"), PERCENT * (run.reference.field("volume") - 1)
    look = {"color": BLACK, "marker": "o", "linestyle": "", "markersize": 5.5, "markeredgecolor": "white", "zorder": 5}
    if len(axes) > 1:
        axes[0].plot(t, change, **look)
    axes[-1].plot(t, np.abs(change), **look)


def _range(shown: Sequence[Run]) -> tuple[float, float]:
    """The smallest and the largest change [%] of runs that ended well: diverging volumes would flatten all others."""
    ended_well = [run for run in shown if run.record.status in COMPARABLE]
    change = np.concatenate([[0.0], *(PERCENT * (run.volume_ratio - 1) for run in ended_well)])
    return float(change.min()), float(change.max())


def _scale(axes: np.ndarray, lowest: float, highest: float, first: bool) -> None:
    if len(axes) > 1:
        low, high = min(-1.0, lowest), max(0.5, highest)
        axes[0].set_ylim(1.08 * low, high + 0.04 * (high - low))
        axes[0].set_ylabel("volume V/V₀ − 1 [%]" if first else "")
        axes[0].tick_params(labelbottom=False)
    axes[-1].set_yscale("log")
    axes[-1].set_ylim(SMALLEST, 1e2)
    axes[-1].set_ylabel("size |V/V₀ − 1| [%]" if first else "")
    axes[-1].set_xlabel("time [s]")
    for panel in axes:
        panel.tick_params(labelleft=first)


draw = drawing(figure)
