"""Other programs and our methods: error of the force and lost volume against computing time."""

from collections.abc import Sequence
from dataclasses import replace

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from studies.base.counting import heading
from studies.exchange.entry import HALF_STEP, is_entry, outside
from studies.metrics.judged import FORCE, cost_of
from studies.metrics.metric import COMPARABLE, Metric
from studies.metrics.run import Run, by_scene
from studies.metrics.table import metric
from studies.plots.style.families import FAMILIES, Family, family_of
from studies.plots.style.page import blank, finish, log_axis, page, panels
from studies.plots.style.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    MUTED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    drawing,
    remark,
    styled,
)

TITLE = "Other programs on the same meshes: down and to the left is better"
VOLUME = metric("volume_worst")
ROWS = {FORCE: "error of the force [%]", VOLUME: "volume off by [%]"}
LOWEST = {FORCE: 0.1, VOLUME: 1e-5}
"""What is smaller is drawn there [%]."""
ROOM = 2.0
SPARE = tuple(
    zip((ORANGE, GREEN, BLUE, PURPLE, BLACK, MUTED[2], MUTED[1], MUTED[0], SKY, VERMILLION), "^sDvX<>hP*", strict=True)
)
"""Colours and markers of what has none of its own, in the order of its appearance."""
NAMED = 2
"""Reasons for having no point that a note gives."""


@styled
def figure(runs: Sequence[Run]) -> Figure:
    """A column for each scene: the force above, the volume below."""
    timed = [run for run in runs if run.record.status in COMPARABLE and cost_of(run).known]
    if not timed:
        return blank(TITLE, "no run with frame times yet")
    scenes = by_scene(timed)
    sheet = page(4.4 * len(scenes) + 0.6, 6.4)
    axes = panels(sheet, 2, len(scenes), sharex=True, sharey="row")
    looks = looks_of(timed)
    for column, (name, group) in enumerate(scenes.items()):
        axes[0, column].set_title(heading(name))
        for row, entry in enumerate(ROWS):
            _draw(axes[row, column], group, entry, looks)
    for row, entry in enumerate(ROWS):
        values = [abs(value) for run in timed if (value := entry(run)) == value]
        axes[row, 0].set_ylim(LOWEST[entry] / ROOM, ROOM * max([1.0, *values]))
        axes[row, 0].set_ylabel(ROWS[entry])
    for panel in axes[:, 0]:
        log_axis(panel.yaxis)
    for panel in axes[-1]:
        panel.set_xlabel("computing time / simulated time [s/s]")
    log_axis(axes[-1, 0].xaxis)
    return finish(
        sheet, TITLE, [*map(_handle, looks.values()), _real_time()], [*_notes(), *_unfinished(runs)], columns=3
    )


def _draw(panel: Axes, group: Sequence[Run], entry: Metric, looks: dict[str, Family]) -> None:
    panel.axvline(1.0, color=BLACK, linewidth=1.2)
    uncertainty = entry.uncertainty(group[0]) if entry is FORCE else float("nan")
    if uncertainty == uncertainty:
        panel.axhspan(LOWEST[entry], max(uncertainty, LOWEST[entry]), color=GREY, alpha=0.3, linewidth=0)
    drawn = 0
    for run in group:
        value, look = entry(run), looks[family_name(run)]
        if value == value:
            drawn += 1
            height = max(abs(value), LOWEST[entry])
            face = "white" if run.case.method.name.endswith(HALF_STEP) else look.colour
            panel.plot(cost_of(run).value, height, **_marks(look), markerfacecolor=face)
    if not drawn:
        remark(panel, "no reference, no error")
    panel.set_xscale("log")
    panel.set_yscale("log")


def looks_of(runs: Sequence[Run]) -> dict[str, Family]:
    """The look of each family by its name, no two of one colour or marker while there are spare ones; with half the
    step it is the same."""
    found = {look.name: look for look in map(_family, runs)}
    looks = {name: look for name, look in found.items() if look in FAMILIES.values()}
    spare = iter(SPARE)
    for name, look in found.items():
        if name not in looks:
            colour, marker = next(spare, (look.colour, look.marker))
            looks[name] = replace(look, colour=colour, marker=marker)
    return {name: looks[name] for name in found}


def family_name(run: Run) -> str:
    """Of the family of a run."""
    return _family(run).name


def _family(run: Run) -> Family:
    if is_entry(run.case):
        return family_of(run.case.replaced(method=outside(run.case.method.name.removesuffix(HALF_STEP))))
    return family_of(run.case)


def _marks(look: Family) -> dict:
    return {"color": look.colour, "marker": look.marker, "linestyle": "", "markersize": 8}


def _handle(look: Family) -> Line2D:
    return Line2D([], [], label=look.name, **_marks(look))


def _real_time() -> Line2D:
    return Line2D([], [], color=BLACK, linewidth=1.2, label="real time")


def _notes() -> list[str]:
    return [
        "Two mesh sizes each; hollow: with half the step. Grey: uncertainty of the reference. Time of our bodies: "
        "median frame on one core. Time of the others: processor time of the whole run. Programs that solve for "
        "equilibria have no frames; they need less time for fewer load steps. Volume: the worst of all "
        "submitted steps; for our bodies, of all frames."
    ]


def _unfinished(runs: Sequence[Run]) -> list[str]:
    """What has no point here, and why: each reason once, with all that it holds for."""
    reasons: dict[str, list[str]] = {}
    for run in runs:
        if run.record.status not in COMPARABLE:
            found = reasons.setdefault(run.record.message, [])
            name = f"{run.case.method.name} on {run.case.scene.name}"
            found += [name] if name not in found else []
    named = [f"{', '.join(names)} ({reason})" for reason, names in list(reasons.items())[:NAMED]]
    more = [f"and {len(reasons) - NAMED} more reasons"] if len(reasons) > NAMED else []
    return ["Not drawn: " + "; ".join([*named, *more]) + "."] if reasons else []


draw = drawing(figure)
