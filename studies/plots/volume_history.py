"""How much volume each model loses over time: in per cent, and again on a logarithmic axis (the paper's Figure 3)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from studies.base.counting import heading
from studies.metrics.metric import COMPARABLE
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

TITLE = "How much volume each model loses"
PERCENT = 100.0
SMALLEST = 1e-10
"""Bottom of the logarithmic axis [%]: below it stands only what rounding leaves."""


@styled
def figure(runs: Sequence[Run]) -> Figure:
    """One column of panels per scene."""
    shown = [run for run in runs if has_frames(run)]
    if not shown:
        return blank(TITLE, "no run has recorded a frame yet")
    scenes, looks = by_scene(shown), body_looks(shown)
    sheet = page(2.7 * len(scenes) + 0.9, 6.0)
    axes = panels(sheet, 2, len(scenes), sharex="col", sharey="row")
    for (name, group), (upper, lower) in zip(scenes.items(), axes.T, strict=True):
        upper.set_title(heading(name))
        for same in grouped(group, lambda run: (run.case.body, run.case.method.name)):
            for run in same:
                _draw_run(upper, lower, run, looks[run.case.body], finer=run is not same[0])
        _draw_reference(upper, lower, group[0])
        lower.set_xlabel("time [s]")
    _scale(axes, shown)
    handles = [*body_method_handles(shown, looks), reference_handle()]
    if len(shown) > len({(run.case.scene.name, run.case.body, run.case.method.name) for run in shown}):
        handles.append(Line2D([], [], color=GREY, linewidth=0.9, label="thin: the same at a smaller time step"))
    return finish(sheet, TITLE, handles, [*_stiffness(shown), *remarks(runs)], columns=3)


def _stiffness(shown: Sequence[Run]) -> list[str]:
    """Why the reference does not lie on zero."""
    ratios = sorted({run.case.scene.tissue.bulk_over_shear for run in shown if run.reference is not None})
    if not ratios:
        return []
    return [f"The tissue of the reference gives way a little: κ/μ = {', '.join(f'{ratio:,.0f}' for ratio in ratios)}."]


def _draw_run(upper: Axes, lower: Axes, run: Run, body: BodyLook, finer: bool) -> None:
    """The first run of a series in full; the same with another step as a thin line where the two differ visibly."""
    good = slice(0, good_frames(run))
    change = PERCENT * (run.volume_ratio[good] - 1)
    look = {"color": body.colour(run.case.method.name), "linestyle": body.line}
    if not finer:
        upper.plot(run.fields.t[good], change, **look)
    # Zero has no logarithm; an exact volume lies on the bottom of the axis.
    lower.plot(run.fields.t[good], np.maximum(np.abs(change), SMALLEST), linewidth=0.9 if finer else 1.6, **look)


def _draw_reference(upper: Axes, lower: Axes, run: Run) -> None:
    if run.reference is None:
        return
    t, change = run.reference.field("t"), PERCENT * (run.reference.field("volume") - 1)
    look = {"color": BLACK, "marker": "o", "linestyle": "", "markersize": 5.5, "markeredgecolor": "white", "zorder": 5}
    upper.plot(t, change, **look)
    lower.plot(t, np.abs(change), **look)


def _scale(axes: np.ndarray, shown: Sequence[Run]) -> None:
    """From what runs that ended well need: a volume on its way to infinity would flatten everything else."""
    ended_well = [run for run in shown if run.record.status in COMPARABLE]
    change = np.concatenate([[0.0], *(PERCENT * (run.volume_ratio - 1) for run in ended_well)])
    lowest, highest = min(-1.0, float(change.min())), max(0.5, float(change.max()))
    axes[0, 0].set_ylim(1.08 * lowest, highest + 0.04 * (highest - lowest))
    axes[0, 0].set_ylabel("volume V/V₀ − 1 [%]")
    axes[1, 0].set_yscale("log")
    axes[1, 0].set_ylim(SMALLEST, 1e2)
    axes[1, 0].set_ylabel("size |V/V₀ − 1| [%]")


draw = drawing(figure)
