"""The page of a chart: title, panels, and below them, outside all data, the legend and the notes."""

import textwrap
from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axis import Axis, XAxis
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter
from scipy.optimize import isotonic_regression

from studies.base.counting import heading, readable
from studies.metrics.cells import DISTURBED_NOTE, MINUS, UNRESOLVED_MARK
from studies.metrics.metric import Metric
from studies.metrics.run import Run, by_scene
from studies.plots.style.style import BLACK, GREY, SMALL, remark, styled
from studies.store.record import Status

ROW, LINE, MARGIN = 0.25, 0.19, 0.12
"""Heights of a legend row, of a line of notes, and of the margin around them [inch]."""
LETTERS = 12.8
"""Letters of a note per inch, so few that a line of wide letters fits."""
NARROWEST = 8.0
"""Width of a page with one panel [inch]."""
HANDLE = 0.62
"""Width of a legend entry without its words [inch]."""
MOST_NOTES, MOST_NAMED = 8, 3
"""Notes below a chart, and cases that one of them names."""
SHORT = 200.0
"""A logarithmic axis whose ends have a smaller ratio than this has numbers between the decades."""


def page(width: float, height: float) -> Figure:
    """An empty page, width and height [inch], at least NARROWEST wide; `finish` adds room for legend and notes."""
    figure = Figure(figsize=(max(width, NARROWEST), height), layout="constrained")
    engine = figure.get_layout_engine()
    assert engine is not None  # set in the line above
    engine.set(w_pad=0.06, h_pad=0.07, wspace=0.03, hspace=0.04)  # pyright: ignore[reportCallIssue]
    return figure


def panels(figure: Figure | SubFigure, rows: int, columns: int, **options: object) -> np.ndarray:
    """Axes as an array of shape (rows, columns), also for a single panel."""
    return figure.subplots(rows, columns, squeeze=False, **options)  # pyright: ignore[reportCallIssue, reportArgumentType]


def panel_grid(
    count: int, columns: int, size: tuple[float, float], margin: tuple[float, float], **options: object
) -> tuple[Figure, np.ndarray]:
    """A page with `count` panels, at most `columns` in a row: the figure, and its axes (rows, columns).

    size: of a panel, margin: of the page, both (width, height) [inch]. Spare axes are hidden.
    """
    columns = min(columns, count)
    rows = -(-count // columns)
    sheet = page(size[0] * columns + margin[0], size[1] * rows + margin[1])
    axes = panels(sheet, rows, columns, **options)
    for spare in axes.flat[count:]:
        spare.set_axis_off()
    return sheet, axes


def finish(
    figure: Figure, title: str, handles: Sequence[Artist], notes: Sequence[str] = (), columns: int = 4
) -> Figure:
    """Adds the title, a legend in up to `columns` columns, and up to MOST_NOTES notes; the page grows accordingly."""
    figure.suptitle(title)
    width, height = (float(size) for size in figure.get_size_inches())
    shown = [*notes[:MOST_NOTES], f"… and {len(notes) - MOST_NOTES} more remarks"] if len(notes) > MOST_NOTES else notes
    lines = [line for note in shown for line in textwrap.wrap(note, int(LETTERS * width))]
    columns = _fitting(columns, [str(handle.get_label()) for handle in handles], width)
    rows = -(-len(handles) // columns)
    foot = rows * ROW + len(lines) * LINE + 2 * MARGIN * bool(rows or lines)
    total = height + foot
    figure.set_figheight(total)
    engine = figure.get_layout_engine()
    assert engine is not None  # page() set one
    engine.set(rect=(0, foot / total, 1, height / total))  # pyright: ignore[reportCallIssue]
    if handles:
        top = (len(lines) * LINE + rows * ROW + MARGIN) / total
        place = {"loc": "upper center", "bbox_to_anchor": (0.5, top), "borderaxespad": 0.0, "borderpad": 0.0}
        figure.legend(handles=handles, ncols=columns, columnspacing=1.6, handlelength=2.4, **place)
    if lines:
        low = 0.6 * MARGIN / total
        figure.text(0.012, low, "\n".join(lines), color=GREY, size=SMALL, va="bottom", ha="left", linespacing=1.25)
    return figure


def _fitting(columns: int, labels: Sequence[str], width: float) -> int:
    """The largest number of legend columns, up to `columns`, that fits into the `width` of the page [inch]."""
    columns = max(1, min(columns, len(labels)))
    while columns > 1:
        longest = [max(map(len, part)) for part in np.array_split(np.array(labels, dtype=object), columns)]
        if sum(longest) / LETTERS + columns * HANDLE <= width:
            break
        columns -= 1
    return columns


@styled
def blank(title: str, reason: str) -> Figure:
    figure = page(8, 2.5)
    axes = figure.subplots()
    axes.set_axis_off()
    remark(axes, reason)
    return finish(figure, title, [])


def grouped(runs: Sequence[Run], key: Callable[[Run], object]) -> list[list[Run]]:
    groups: dict[object, list[Run]] = {}
    for run in runs:
        groups.setdefault(key(run), []).append(run)
    return list(groups.values())


def remarks(runs: Sequence[Run]) -> list[str]:
    """A sentence for each run that broke off, one on those that are whole but not ok, and one on the scenes without a
    reference."""
    ended = [f"{run.case.name}: {run.record.message or run.record.status}." for run in runs if not has_frames(run)]
    ended += [
        f"{run.case.name} {readable(run.record.status)}; shown up to there."
        for run in runs
        if has_frames(run) and good_frames(run) < len(run.fields.t)
    ]
    whole = [run for run in runs if has_frames(run) and good_frames(run) == len(run.fields.t)]
    unsound = [f"{run.case.name} {readable(run.record.status)}" for run in whole if run.record.status != Status.OK]
    if unsound:
        ended.append(f"Not ok: {first_of(unsound)}.")
    bare = [name for name, group in by_scene(runs).items() if all(run.reference is None for run in group)]
    missing = [f"No error is shown for {', '.join(map(readable, bare))}, because it has no reference."] if bare else []
    return [*missing, *ended]


def timing_notes(runs: Sequence[Run]) -> list[str]:
    """On the frame times of runs: of which processor, how much of them was processor time, which are disturbed."""
    timed = [(run, run.timing) for run in runs if run.timing is not None]
    names = ", ".join(dict.fromkeys(timing.processor for _, timing in timed if timing.processor))
    shares = [100 * own.sum() / timing.frame_ns.sum() for _, timing in timed if (own := timing.cpu_ns) is not None]
    ends = " to ".join(dict.fromkeys(f"{end:.0f}" for end in (min(shares), max(shares)))) if shares else ""
    notes = [f"Wall times of {names}; processor time is {ends} % of them."] if shares else []
    disturbed = [run.case.name for run, timing in timed if timing.disturbed]
    if disturbed:
        notes.append(f"{DISTURBED_NOTE}: {first_of(disturbed)}.")
    return notes


def first_of(names: Sequence[str]) -> str:
    """The first MOST_NAMED, and how many more."""
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return ", ".join(names[:MOST_NAMED]) + more


def unresolved_notes(runs: Sequence[Run], metrics: Sequence[Metric]) -> list[str]:
    """A note for each scene in which the uncertainty of the reference is over a tenth of an error of these metrics: its
    share of the smallest error of each such metric."""
    notes = []
    for name, group in by_scene(runs).items():
        parts = []
        for metric in metrics:
            shares = [_share(metric, run) for run in group if metric.unresolved(run)]
            if shares:
                most = max(shares)
                share = f"up to {100 * most:.0f} % of the" if most < 1 else "at least as large as the smallest"
                what = readable(metric.name)
                parts.append(f"{share} {what}" if what.endswith("error") else f"{share} {what} error")
        if parts:
            whose = f"{UNRESOLVED_MARK} {heading(name)}: the uncertainty of the reference is"
            notes.append(f"{whose} {', '.join(parts)}.")
    return notes


def _share(metric: Metric, run: Run) -> float:
    error = abs(metric(run))
    return metric.uncertainty(run) / error if error else np.inf


def unresolved_mark(group: Sequence[Run], metrics: Sequence[Metric]) -> str:
    """The mark after the name of a scene on which `unresolved_notes` has a note; else ""."""
    return f" {UNRESOLVED_MARK}" if any(metric.unresolved(run) for metric in metrics for run in group) else ""


def has_frames(run: Run) -> bool:
    return "t" in run.record.fields and good_frames(run) > 0


def good_frames(run: Run) -> int:
    return int(run.record.attributes.get("good_frames", len(run.fields.t)))


def reference_handle(label: str = "reference (finite elements)", **look: object) -> Line2D:
    plain = {"marker": "o", "linestyle": "", "markersize": 5.5, "markeredgecolor": "white"} | look
    return Line2D([], [], color=BLACK, label=label, **plain)  # pyright: ignore[reportArgumentType]


def band_handle(label: str) -> Patch:
    return Patch(facecolor=GREY, alpha=0.3, linewidth=0, label=label)


def hollow_handle(colour: str) -> Line2D:
    return Line2D(
        [],
        [],
        color=colour,
        marker="o",
        linestyle="",
        markersize=7,
        markerfacecolor="white",
        label="hollow: the reference is not ten times better",
    )


def log_axis(axis: Axis) -> None:
    """Makes an axis logarithmic with plain numbers: 0.1, 1, 10, and 2 and 5 between them on a short axis.

    Decades below 0.01 are powers of ten.
    """

    def decade(value: float, _: int) -> str:
        return f"{value:g}" if value > 0.9e-2 else f"$10^{{{np.log10(value):.0f}}}$"

    def between(value: float, _: int) -> str:
        low, high = axis.get_view_interval()
        first = round(value / 10 ** np.floor(np.log10(value)))
        return f"{value:g}" if first in (2, 5) and high < SHORT * low else ""

    (axis.axes.set_xscale if isinstance(axis, XAxis) else axis.axes.set_yscale)("log")
    axis.set_major_formatter(FuncFormatter(decade))
    axis.set_minor_formatter(FuncFormatter(between))
    axis.set_tick_params(which="minor", labelsize=SMALL)


def spread_out(heights: np.ndarray, gap: float, highest: float = np.inf) -> np.ndarray:
    """The heights (n,) nearest to `heights` (n,) by least squares, in the same order and at least `gap` apart.

    None is above `highest`, unless the lowest would then be below zero.
    """
    order = np.argsort(heights, kind="stable")
    ladder = gap * np.arange(len(heights))
    placed = np.empty(len(heights))
    room = max(highest - ladder[-1], 0.0) if len(ladder) else highest
    placed[order] = np.minimum(isotonic_regression(heights[order] - ladder).x, room) + ladder
    return placed


def signed_percent(value: float) -> str:
    """ "−35 %", "+0.3 %": whole from ten on, one digit below; "0.0 %" without a sign."""
    text = f"{value:+.{1 if abs(value) < 9.95 else 0}f}"
    return f"{'0.0' if text in ('+0.0', '-0.0') else text} %".replace("-", MINUS)
