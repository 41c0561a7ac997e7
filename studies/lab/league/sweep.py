"""The settings of every program: a small search on two scenes, whose best are then taken for all others.

`python -m studies.lab.league --sweep` writes the table; PROGRAMS has what it chose.
"""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from studies import BALL_SQUEEZE, LIVER_PRESS, METRICS, Scene, Status
from studies.lab.league.programs import Program, Surroundings, entered

SWEPT, NODES = (LIVER_PRESS, BALL_SQUEEZE), 150
"""An organ that is held and bent, and a free ball that is flattened: with a Poisson ratio of 0.3 coarse tetrahedra lock
less in the first and give way in the second. Every program knows their planes."""
SHARE = "share of the target [1]"
"""The largest of the errors over their targets."""
COST = "cost [s/s]"
TARGETS = {"force_end": 3.0, "mean_error": 1.0, "volume_worst": 1.0}
"""The usual target of errors of force and displacement, and one for lost volume [%]: else a tissue that gives way would
be the best setting of coarse tetrahedra."""
ERRORS = [metric for metric in METRICS if metric.name in TARGETS]
AS_GOOD, AS_CHEAP = 1.05, 1.25
"""Factors on the smallest error and on the cost within which two settings are alike; measured costs vary by as much."""
DIALS: dict[str, dict[str, tuple[float, ...]]] = {
    "mujoco": {"poisson": (0.45, 0.4, 0.3), "step": (1e-3,), "stiff": (4.0,)},
    "felupe": {"increments": (8,), "penalty": (10.0,)},
    "newton": {"lame": (9.0, 4.0, 1.5), "step": (2.5e-3,), "sweeps": (20,), "penalty": (5e2, 8e3)},
    "bullet": {"lame": (9.0, 4.0, 1.5), "step": (1.25e-4,), "damping": (0.02,)},
    "drake": {"poisson": (0.45, 0.4, 0.3), "step": (5e-3,), "finest": (1e-3,)},
    "sfepy": {"increments": (4,), "penalty": (500.0, 8000.0)},
}
"""Values that are tried for each program, one keyword of its adapter after the other, each starting from the best so
far. The first row of a program has the defaults of its adapter. No fewer load steps are tried: on two scenes they cost
less, and on a third one SfePy's Newton iterations fail with one."""


def swept(program: Program, at: Surroundings) -> Iterator[dict[str, Any]]:
    """A row for each of its settings and scene."""
    rows = []

    def tried(settings: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
        for scene in SWEPT:
            rows.append(_row(replace(program, settings=settings), scene, at))
            yield rows[-1]

    yield from tried({})
    for dial, values in DIALS.get(program.name, {}).items():
        base = best(rows) or {}
        for value in values:
            yield from tried(base | {dial: value})


def _row(program: Program, scene: Scene, at: Surroundings) -> dict[str, Any]:
    run = entered(program, scene, NODES, at, at.folder / "results")
    row = {"engine": program.name, "settings": json.dumps(dict(program.settings)), "scene": scene.name}
    row["status"] = str(run.record.status)
    if run.record.status != Status.OK:
        return row | {"message": run.record.message}
    errors = {metric.name: metric(run) for metric in ERRORS}
    return (
        row
        | {f"{name} [%]": errors[name] for name in TARGETS}
        | {
            COST: run.record.attributes["entry_seconds"],
            SHARE: worst_share(errors),
        }
    )


def worst_share(errors: Mapping[str, float]) -> float:
    """The largest of the errors [%] over their targets; one that cannot be judged is left out: the displacement of the
    free ball is prescribed."""
    return max(abs(errors[name]) / target for name, target in TARGETS.items() if not math.isnan(errors[name]))


def best(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any] | None:
    """The settings of a program with the smallest worst share of the target; of those that are AS_GOOD the cheapest,
    and of those that are AS_CHEAP the first. None where none ended well on every scene."""
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault(row["settings"], []).append(row)
    ended = [
        (max(row[SHARE] for row in group), max(row[COST] for row in group), settings)
        for settings, group in groups.items()
        if not any(math.isnan(row.get(SHARE, math.nan)) for row in group)
    ]
    if not ended:
        return None
    smallest = min(share for share, _, _ in ended)
    good = [(cost, settings) for share, cost, settings in ended if share <= AS_GOOD * smallest]
    cheapest = min(cost for cost, _ in good)
    return json.loads(next(settings for cost, settings in good if cost <= AS_CHEAP * cheapest))
