"""The time of a frame: history and percentiles for every body and method, and deadlines."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from studies.base.counting import heading
from studies.metrics.cells import DISTURBED_MARK
from studies.metrics.run import Run
from studies.metrics.timing.protocol import FrameTiming
from studies.metrics.timing.statistics import percentiles
from studies.plots.style.bodies import body_looks
from studies.plots.style.page import band_handle, blank, finish, grouped, log_axis, page, panels, remarks, timing_notes
from studies.plots.style.style import BLACK, GREY, SMALL, drawing, method_colour, method_label, styled

TITLE = "Time of a frame"
DEADLINES_MS = {33.0: "33 ms", 2.0: "2 ms", 1.0: "1 ms"}
"""Video at 30 frames/s, haptics at 500 Hz and at 1 kHz."""
DASHES = (0, (5, 3))
COLUMNS = 3
QUANTILE_MARKERS = {"p50": "o", "p95": "|", "p99": "D", "max": "x"}
NS_PER_MS = 1e6


@styled
def figure(runs: Sequence[Run]) -> Figure:
    timed = [(run, run.timing) for run in runs if run.timing is not None]
    if not timed:
        return blank(TITLE, "no frame times from this machine and this code yet")
    bodies = grouped([run for run, _ in timed], lambda run: (run.case.scene.name, run.case.body))
    names = _names([run for run, _ in timed])
    rows, strip = -(-len(bodies) // COLUMNS), 0.27 * len(timed) + 1.1
    sheet = page(11, 2.6 * rows + strip)
    above, below = sheet.subfigures(2, 1, height_ratios=[2.6 * rows, strip])  # pyright: ignore[reportGeneralTypeIssues]
    axes = panels(above, rows, COLUMNS, sharey=True)
    span = _span([timing for _, timing in timed])
    for panel, body in zip(axes.flat, bodies, strict=False):
        _draw_history(panel, body, span, names[id(body[0])])
    for last in [*axes[:-1, -1], axes.flat[len(bodies) - 1]]:
        _label_deadlines(last)
    for spare in axes.flat[len(bodies) :]:
        spare.set_axis_off()
    for left in axes[:, 0]:
        left.set_ylabel("frame time [ms]")
    for low in axes.flat[max(0, len(bodies) - COLUMNS) : len(bodies)]:
        low.set_xlabel("simulated time [s]")
    _draw_percentiles(below.subplots(), bodies, span, names)
    notes = [_protocol([t for _, t in timed]), *timing_notes(runs), *remarks(_untimed(runs))]
    return finish(sheet, TITLE, _handles(timed), notes, columns=7)


def _untimed(runs: Sequence[Run]) -> list[Run]:
    return [run for run in runs if run.timing is None and run.case.timed]


def _span(timings: Sequence[FrameTiming]) -> tuple[float, float]:
    """Ends of the axis [ms]: below the fastest frame, and above the slowest frame and the largest deadline."""
    fastest = min(float(timing.frame_ns.min()) for timing in timings) / NS_PER_MS
    slowest = max(float(timing.frame_ns.max()) for timing in timings) / NS_PER_MS
    return fastest / 1.6, 1.6 * max(slowest, max(DEADLINES_MS))


def _draw_history(axes: Axes, body: Sequence[Run], span: tuple[float, float], name: str) -> None:
    for run in body:
        assert run.timing is not None  # figure() has chosen these
        frames, t = run.timing.frame_ns / NS_PER_MS, run.fields.t
        colour = method_colour(run.case.method.name)
        low, high = frames.min(axis=0), frames.max(axis=0)
        # Rasterised in an SVG too, because the band has a corner at every frame.
        if not run.timing.disturbed:
            axes.fill_between(t, low, high, color=colour, alpha=0.35, linewidth=0, rasterized=True)
        axes.plot(t, np.median(frames, axis=0), color=colour, linewidth=1.1)
    for deadline in DEADLINES_MS:
        axes.axhline(deadline, color=GREY, linewidth=1, linestyle=DASHES)
    attributes = body[0].record.attributes
    log_axis(axes.yaxis)
    axes.set(ylim=span, xlim=(0, body[0].case.scene.duration))
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    axes.set_title(f"{name}\n{attributes['steps']} steps of {1e3 * attributes['dt']:.2g} ms", size=SMALL + 0.5)


def _label_deadlines(axes: Axes) -> None:
    for deadline, words in DEADLINES_MS.items():
        axes.text(1.02, deadline, words, transform=axes.get_yaxis_transform(), size=SMALL, color=GREY, va="center")


def _names(runs: Sequence[Run]) -> dict[int, str]:
    looks = body_looks(runs, ignored=("nodes",))
    return {
        id(run): f"{heading(run.case.scene.name)}, {looks[run.case.body].name}, {run.case.body.nodes:,}" for run in runs
    }


def _draw_percentiles(
    axes: Axes, bodies: Sequence[Sequence[Run]], span: tuple[float, float], names: dict[int, str]
) -> None:
    labels: list[str] = []
    for body in bodies:
        for place, run in enumerate(body):
            assert run.timing is not None  # figure() has chosen these
            quantiles = {name: ns / NS_PER_MS for name, ns in percentiles(run.timing.frame_ns).items()}
            colour = method_colour(run.case.method.name)
            axes.plot([quantiles["p50"], quantiles["max"]], [len(labels)] * 2, color=colour, linewidth=1)
            for name, marker in QUANTILE_MARKERS.items():
                axes.plot(quantiles[name], len(labels), marker=marker, color=colour, markersize=6, markeredgewidth=1.8)
            mark = f" {DISTURBED_MARK}" if run.timing.disturbed else ""
            labels.append((names[id(run)] if place == 0 else "") + mark)
    for deadline in DEADLINES_MS:
        axes.axvline(deadline, color=GREY, linewidth=1, linestyle=DASHES)
        words, place = f"{deadline:g} ms", (deadline, 1.01)
        axes.text(*place, words, transform=axes.get_xaxis_transform(), size=SMALL, color=GREY, ha="center")
    axes.set_yticks(range(len(labels)), labels)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.set_ylim(len(labels) - 0.4, -0.6)
    log_axis(axes.xaxis)
    axes.set(xlim=span, xlabel="frame time [ms]: median to slowest of all frames of all repeats")


def _handles(timed: Sequence[tuple[Run, FrameTiming]]) -> list:
    methods = dict.fromkeys(run.case.method.name for run, _ in timed)
    lines = [Line2D([], [], color=method_colour(name), label=method_label(name)) for name in methods]
    marks = [
        Line2D([], [], color=BLACK, marker=marker, linestyle="", markeredgewidth=1.8, markersize=6, label=name)
        for name, marker in QUANTILE_MARKERS.items()
    ]
    return [*lines, band_handle("fastest to slowest repeat"), *marks]


def _protocol(timings: Sequence[FrameTiming]) -> str:
    repeats = sorted({len(timing.frame_ns) for timing in timings})
    threads = sorted({timing.threads for timing in timings})
    return (
        f"Line: median of {', '.join(map(str, repeats))} repeats, which take turns; {', '.join(map(str, threads))} "
        "thread, one core, compilation and warm-up outside. Number after a body: its surface nodes. "
        "Dashed: deadlines of video at 30 Hz and of touch at 500 Hz and 1 kHz."
    )


draw = drawing(figure)
