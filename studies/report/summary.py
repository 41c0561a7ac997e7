"""Tables for people to read, in Markdown: the results of `make study`, the recommended bodies, and the accuracy of
each rung of the ladder of bodies."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any, NamedTuple

from studies.metrics.cells import (
    DISTURBED_MARK,
    DISTURBED_NOTE,
    FEW_NOTE,
    MISSING,
    UNCONVERGED_NOTE,
    UNRESOLVED_MARK,
    UNRESOLVED_NOTE,
    value_cell,
)
from studies.metrics.judged import Judged, Measured, cheapest, judged, nearest, over_meshes
from studies.metrics.run import Run
from studies.metrics.table import FEW_FACETS, UNCONVERGED, UNRESOLVED, marked, study_table
from studies.metrics.wish import Wish, usual_wish
from studies.runs.recipe_text import body_words
from studies.scene.scene import Scene
from studies.store.record import Status

PAPER = 550
"""Surface nodes of the paper's body where it is compared with others."""
LADDER_SCENES = ("ball_clamped", "liver_press")
"""Scenes in which every rung has a force and a displacement."""
WHY_NONE = "no body meets the target and keeps the shape, or the reference is not accurate enough to decide"


def results_of(runs: Sequence[Run]) -> str:
    """Accuracy of each scene, body and method, with the uncertainty of the reference."""
    rows = study_table(runs, [column.split(" [")[0] for column in SUMMARY_HEADS])
    if rows.empty:
        return "No results yet: run `make study`."
    rows = rows.loc[~(rows["dt/dt_c"] <= 0.25)]  # a case that failed has no step, and stays
    lines = [
        "| scene | body | method | " + " | ".join(SUMMARY_HEADS.values()) + " |",
        "|---|---|---|" + "---|" * len(SUMMARY_HEADS),
    ]
    for row in rows.to_dict("records"):
        cells = [_cell(row, name) for name in SUMMARY_HEADS]
        status = "" if row["status"] == Status.OK else f" (*{row['status']}*)"
        lines.append(f"| {row['scene']} | {row['body']} | {marked(row)}{status} | " + " | ".join(cells) + " |")
    if any(UNRESOLVED_MARK in line for line in lines):
        lines += ["", UNRESOLVED_NOTE]
    if rows[UNCONVERGED].any():
        lines += ["", UNCONVERGED_NOTE]
    if FEW_FACETS in rows and rows[FEW_FACETS].any():
        lines += ["", FEW_NOTE]
    return "\n".join(lines)


SUMMARY_HEADS = {
    "volume_worst [%]": "worst \\|V/V0 − 1\\| [%]",
    "force_end [%]": "force [%]",
    "interior_error [%]": "interior rel. L2 [%]",
    "mean_error [%]": "surface mean / max u [%]",
    "silhouette_error [%]": "silhouette / size [%]",
    "shape_error [%]": "rest shape / size [%]",
    "shape_volume [%]": "rest volume [%]",
    "min_j [1]": "min J",
}
"""Columns of the table of a study, and what they are called."""


def _cell(row: Mapping[Hashable, Any], column: str) -> str:
    value = float(row[column])
    if value != value:
        return MISSING
    if column.startswith("min_j"):
        return f"{value:.2f}"
    if column.startswith(("volume", "shape_error")):
        return f"{value:.2g}"
    uncertainty = float(row.get(column.replace(" [", " floor ["), float("nan")))
    unresolved = column.split(" [")[0] in str(row.get(UNRESOLVED, "")).split()
    return value_cell(value, uncertainty, signed=column.startswith(("force", "shape_volume")), unresolved=unresolved)


class Choice(NamedTuple):
    wish: Wish
    """The usual target of the scene."""
    body: Judged
    """The cheapest that meets it and keeps the shape; where there is none, the closest."""
    meets: bool


def choice_of(scene: Scene, bodies: Sequence[Judged]) -> Choice | None:
    """The choice among the bodies of a scene; None where no body that may be recommended has an error."""
    wish = usual_wish(scene)
    best = cheapest(bodies, wish)
    chosen = best or nearest(bodies, wish)
    return None if chosen is None else Choice(wish, chosen, best is not None)


def compared_bodies(runs: Sequence[Run]) -> dict[str, list[Judged]]:
    """Name of a scene -> its runs that ended well and have an error, in their order, with the neighbouring meshes
    of a recipe as one."""
    scenes: dict[str, list[Judged]] = {}
    for one in map(judged, runs):
        if one is not None and one.compared:
            scenes.setdefault(one.case.scene.name, []).append(one)
    return {name: over_meshes(bodies) for name, bodies in scenes.items()}


def paper_body(bodies: Sequence[Judged]) -> Judged | None:
    papers = (one for one in bodies if one.case.body.kind == "surface" and one.case.body.nodes == PAPER)
    return next((one for one in papers if one.advisable), None)


def recommended_of(runs: Sequence[Run]) -> str:
    """Of every scene the paper's body and the body that `organbench advise` chooses for the usual wish: the cheapest
    that meets it and keeps the shape, else the nearest, marked."""
    lines = [
        "| scene | the paper's body: force [%] | mean [%] | recommended: body, surface nodes, step / limit | force [%] "
        "| mean [%] | rest shape / size [%] | rest volume [%] | simulated / computing time |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    marked, shown = False, []
    for name, bodies in compared_bodies(runs).items():
        choice, paper = choice_of(bodies[0].case.scene, bodies), paper_body(bodies)
        if choice is None or paper is None:
            continue
        marked |= not choice.meets
        chosen = choice.body
        shown.append(chosen)
        words = f"{body_words(chosen.case.body)}, {chosen.case.dt_fraction:g}{'' if choice.meets else ' ‡'}"
        cells = [*_errors(paper), words, *_errors(chosen), *_shape(chosen), _real_time(chosen)]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    if marked:
        lines += ["", f"‡ the closest candidate: {WHY_NONE}"]
    return "\n".join([*lines, *_on_times(shown)])


def ladder_of(runs: Sequence[Run]) -> str:
    """Every body of LADDER_SCENES by *implicit_volume*, from the paper's to graded quadratic ones."""
    lines = [
        "| scene | body, surface nodes | kept volumes | step / limit | force [%] | mean [%] | rest shape / size [%] "
        "| rest volume [%] | simulated / computing time |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    shown = []
    volumes = {run.case.key: int(run.record.attributes.get("volumes", 0)) for run in runs}
    for name, bodies in compared_bodies(runs).items():
        for one in bodies:
            if name in LADDER_SCENES and one.advisable:
                cells = [body_words(one.case.body), str(volumes[one.case.key]), f"{one.case.dt_fraction:g}"]
                lines.append(f"| {name} | " + " | ".join([*cells, *_errors(one), *_shape(one), _real_time(one)]) + " |")
                shown.append(one)
    return "\n".join([*lines, *_on_times(shown)])


def _errors(one: Judged) -> list[str]:
    """Of a recipe on five meshes "2.3 ± 0.1, median 0.9": the largest, and the median of the sizes."""
    cells = []
    for name, error in (("force", one.force), ("displacement", one.displacement)):
        median = f", median {one.median(name):.2g}" if one.members and error.known else ""
        cells.append(_percent(error, signed=name == "force") + median)
    return cells


def _shape(one: Judged) -> list[str]:
    """How far a body at rest is from the true shape: two digits, for the sampling is not better."""
    return [f"{one.shape.value:.2g}" if one.shape.known else MISSING, value_cell(one.shape_volume.value, signed=True)]


def _percent(error: Measured, signed: bool) -> str:
    return value_cell(error.value, error.uncertainty, signed=signed)


def _real_time(one: Judged) -> str:
    """Simulated over computing time and, in brackets, over processor time."""
    wall, own = (value_cell(1.0 / cost.value) for cost in (one.cost, one.processor_cost))
    mark = f" {DISTURBED_MARK}" if one.disturbed else ""
    return (wall if own == MISSING else f"{wall} ({own})") + mark


def _on_times(shown: Sequence[Judged]) -> list[str]:
    """Lines below a table with times: the processor, and that some are disturbed."""
    names = ", ".join(dict.fromkeys(one.processor for one in shown if one.processor))
    lines = ["", f"Times of {names}; in brackets of processor time"] if names else []
    return lines + (["", DISTURBED_NOTE] if any(one.disturbed for one in shown) else [])


SUMMARIES: dict[str, dict[str, Callable[[Sequence[Run]], str]]] = {
    "volume_loss": {"summary.md": results_of},
    "accuracy": {"accuracy/recommended.md": recommended_of, "accuracy/ladder.md": ladder_of},
}
"""Study -> file below the results folder -> its text."""
