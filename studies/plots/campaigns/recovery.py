"""Whether a body returns from an impossible start: the smallest volume ratio of its tetrahedra over time."""

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.base.counting import heading, readable
from studies.metrics.run import Run, by_scene
from studies.metrics.table import metric
from studies.plots.style.bodies import BodyLook, body_handle, body_looks
from studies.plots.style.page import blank, finish, good_frames, grouped, has_frames, log_axis, panel_grid
from studies.plots.style.style import BLACK, GREY, PURPLE, SMALL, drawing, method_colour, styled
from studies.runs.case import Case, chosen_settings
from studies.runs.recipes import BodyRecipe

TITLE = "From which starts a body finds its rest shape again"
LOWEST, HIGHEST = -1.6, 1.15
COLUMNS = 3
CHOSEN = PURPLE
RETURNED = 0.01
"""RMS distance from the rest shape over the size [%] below which a body has returned."""


@styled
def figure(runs: Sequence[Run]) -> Figure:
    shown = [run for run in runs if has_frames(run) and len(run.fields.tetrahedra)]
    if not shown:
        return blank(TITLE, "no run of a body with tetrahedra has recorded a frame yet")
    scenes, looks = by_scene(shown), body_looks(shown)
    sheet, axes = panel_grid(len(scenes), COLUMNS, (3.1, 2.7), (0.6, 0.3), sharex=True, sharey=True)
    for panel, (name, group) in zip(axes.flat, scenes.items(), strict=False):
        _draw_start(panel, group, looks)
        panel.set_title(heading(name.removeprefix("stress_")))
    for panel in axes[:, 0]:
        panel.set_ylabel("smallest J [1]")
    for panel in axes.flat[max(0, len(scenes) - axes.shape[1]) : len(scenes)]:
        panel.set_xlabel("time [s]")
        panel.tick_params(labelbottom=True)
    notes = [
        "J is the volume of a tetrahedron over its rest volume: 1 at rest, 0 flat, below 0 inverted. "
        f"Less than {LOWEST:g} is drawn there.",
        *_ends(shown, looks),
    ]
    return finish(sheet, TITLE, _handles(shown, looks), notes, columns=3)


def _draw_start(axes: Axes, group: Sequence[Run], looks: dict[BodyRecipe, BodyLook]) -> None:
    axes.axhspan(LOWEST - 1, 0.0, color=GREY, alpha=0.13, linewidth=0)
    axes.axhline(1.0, color=BLACK, linewidth=0.8)
    axes.annotate(
        "inverted",
        (0.0, 0.0),
        (6, -4),
        axes.get_yaxis_transform(),
        "offset points",
        va="top",
        color=GREY,
        fontsize=SMALL,
    )
    for run in group:
        good = slice(0, good_frames(run))
        look = {"color": _colour(run.case), "linestyle": looks[run.case.body].line}
        axes.plot(run.fields.t[good], np.maximum(run.fields.min_j[good], LOWEST), **look)
    axes.set_ylim(LOWEST - 0.05, HIGHEST)
    log_axis(axes.xaxis)


def _colour(case: Case) -> str:
    return CHOSEN if chosen_settings(case.method) else method_colour(case.method.name)


def _handles(shown: Sequence[Run], looks: dict[BodyRecipe, BodyLook]) -> list[Artist]:
    entries = []
    for case in {(looks[run.case.body], run.case.method_words): run.case for run in shown}.values():
        entry = body_handle(looks[case.body], case.method.name)
        entry.set(color=_colour(case), label=_model(case, looks))
        entries.append(entry)
    return entries


def _model(case: Case, looks: dict[BodyRecipe, BodyLook]) -> str:
    """Body, and method with its settings: "tetrahedral, nodal volumes, implicit volume recovers"."""
    return f"{looks[case.body].name}, {readable(case.method_words)}"


def _ends(shown: Sequence[Run], looks: dict[BodyRecipe, BodyLook]) -> list[str]:
    """A sentence for each model: from how many starts it returns, and what share of elements else stays inverted."""
    inverted, distance = metric("inverted_share"), metric("rest_distance")
    sentences = []
    for group in grouped(shown, lambda run: (looks[run.case.body], run.case.method_words)):
        lost = [run for run in group if not distance(run) < RETURNED]
        shares = np.array([share for share in map(inverted, lost) if share == share])
        left = ""
        if len(shares):
            span = dict.fromkeys(
                f"{share:.2g}" if share < 10 else f"{share:.0f}" for share in (shares.min(), shares.max())
            )
            left = f"; else {' to '.join(span)} % stay flat or inverted"
        sentences.append(f"{_model(group[0].case, looks)}: back from {len(group) - len(lost)} of {len(group)}{left}.")
    return sentences


draw = drawing(figure)
