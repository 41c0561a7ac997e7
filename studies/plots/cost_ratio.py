"""Ratio of the frame times with and without the constraint, and whether it differs measurably from 1."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from massspring import Free
from studies.base.counting import heading
from studies.metrics.cells import DISTURBED_MARK
from studies.metrics.run import Run
from studies.metrics.timing.statistics import Ratio, ratio_with_spread
from studies.plots.style.bodies import body_looks
from studies.plots.style.page import blank, finish, grouped, page, timing_notes
from studies.plots.style.style import BLACK, GREY, NORMAL, drawing, method_colour, method_label, styled

TITLE = "Cost of keeping the volume"
Row = tuple[str, str, Ratio, bool]
"""Body, method, the ratio of its frame time to that of the method without a constraint, whether either is disturbed."""


@styled
def figure(runs: Sequence[Run]) -> Figure:
    rows = ratios(runs)
    if not rows:
        return blank(TITLE, "no body has been timed with and without a constraint by this machine and this code yet")
    sheet = page(9.5, 0.5 * len(rows) + 1.3)
    axes = sheet.subplots()
    for place, row in enumerate(rows):
        _draw_row(axes, place, row)
    axes.axvline(1.0, color=BLACK, linewidth=1.2)
    axes.set_yticks(range(len(rows)), [body for body, *_ in rows])
    axes.tick_params(axis="y", length=0, labelsize=NORMAL)
    axes.grid(visible=False, axis="y")
    low, high = min(ratio.low for _, _, ratio, _ in rows), max(ratio.high for _, _, ratio, _ in rows)
    axes.set(xlim=(min(0.95, 0.97 * low), max(1.1, 1.03 * high)), ylim=(len(rows) - 0.4, -0.6))
    axes.set_xlabel("frame time with the constraint over frame time without [1]")
    methods = dict.fromkeys(method for _, method, *_ in rows)
    handles = [Line2D([], [], color=method_colour(m), marker="o", label=f"{method_label(m)} / free") for m in methods]
    unclear = "not resolvable: too few repeats, or 1 inside the interval"
    handles.append(Line2D([], [], color=GREY, marker="o", markerfacecolor="white", label=unclear))
    confidence = ", ".join(sorted({f"{100 * ratio.confidence:.0f} %" for _, _, ratio, _ in rows}))
    notes = [
        f"Bar: interval of the median ratio over the repeats, confidence {confidence}. "
        "Number after a body: its surface nodes.",
        *timing_notes(runs),
    ]
    return finish(sheet, TITLE, handles, notes, columns=3)


def ratios(runs: Sequence[Run]) -> list[Row]:
    """Frame time of every timed method over that of `Free` with the same body in the same scene, with its interval."""
    rows: list[Row] = []
    looks = body_looks(runs, ignored=("nodes",))
    for body in grouped([run for run in runs if run.timing], lambda run: run.case.replaced(method=Free()).key):
        free = next((run.timing for run in body if run.case.method.name == Free.name), None)
        for run in body:
            if free is None or run.timing is None or run.case.method.name == Free.name:
                continue
            case = run.case
            name = f"{heading(case.scene.name)}, {looks[case.body].name}, {case.body.nodes:,}"
            disturbed = bool(run.timing.disturbed or free.disturbed)
            rows.append((name, case.method.name, ratio_with_spread(run.timing.frame_ns, free.frame_ns), disturbed))
    return rows


def _draw_row(axes: Axes, place: int, row: Row) -> None:
    _, method, ratio, disturbed = row
    clear = ratio.resolvable and not disturbed
    colour = method_colour(method) if clear else GREY
    bar = [] if disturbed else [ratio.low, ratio.high]
    axes.plot(bar, [place] * len(bar), color=colour, linewidth=3.5, alpha=0.45, solid_capstyle="butt")
    axes.plot(ratio.median, place, marker="o", color=colour, markersize=8, markerfacecolor=colour if clear else "white")
    words = f"{ratio.median:.2f}  ({ratio.low:.2f} to {ratio.high:.2f})"
    words = words if clear else f"not resolvable  ({ratio.low:.2f} to {ratio.high:.2f})"
    words = f"{ratio.median:.2f}  {DISTURBED_MARK}" if disturbed else words
    axes.text(1.02, place, words, transform=axes.get_yaxis_transform(), color=colour, va="center", size=NORMAL)


draw = drawing(figure)
