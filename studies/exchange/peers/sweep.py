"""The settings of every program: a small search on two scenes, whose best are then taken for all others.

`python -m studies.exchange.peers.main --sweep` writes the table; PEERS has what it chose.
"""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from studies.exchange.entry import run_of_entry
from studies.exchange.export import export
from studies.exchange.peers.contest import Attempt, Peer, judged
from studies.metrics.judged import judged as judged_run
from studies.metrics.table import metric
from studies.metrics.wish import SOLID
from studies.reference.load import reference_for
from studies.scene.library import BALL_SQUEEZE, LIVER_PRESS
from studies.scene.scene import Scene
from studies.store.record import Record, Status

SWEPT, NODES = (LIVER_PRESS, BALL_SQUEEZE), 150
"""An organ that is held and bent, and a free ball that is flattened: with a Poisson ratio of 0.3 coarse tetrahedra lock
less in the first and give way in the second. Every program knows their planes."""
SHARE = "share of the target [1]"
"""The largest of the errors of force, displacement and volume, over their default targets."""
COST = "cost [s/s]"
VOLUME, LOST = metric("volume_worst"), 1.0
"""Metric of the volume error, and its target [%]."""
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


def swept(peer: Peer, folder: Path, limit: float, environments: Path) -> Iterator[dict[str, Any]]:
    """A row for each of its settings and scene, with the scenes exported into `folder`. Raises StudyError where that
    fails."""
    rows = []

    def tried(settings: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
        for scene in SWEPT:
            rows.append(_row(replace(peer, settings=settings), scene, folder, limit, environments))
            yield rows[-1]

    yield from tried({})
    for dial, values in DIALS.get(peer.name, {}).items():
        base = best(rows) or {}
        for value in values:
            yield from tried(base | {dial: value})


def _row(peer: Peer, scene: Scene, folder: Path, limit: float, environments: Path) -> dict[str, Any]:
    given = folder / f"{scene.name}-{NODES}"
    if not given.exists():
        export(scene, given, NODES)
    record = judged(Attempt(peer, scene, NODES), given, limit, environments)
    settings = json.dumps(dict(peer.settings))
    return {"engine": peer.name, "settings": settings, "scene": scene.name} | _numbers(record, scene)


def _numbers(record: Record, scene: Scene) -> dict[str, Any]:
    run = run_of_entry(record, reference_for(Path(), scene)) if record.status == Status.OK else None
    judgement = None if run is None else judged_run(run)
    if run is None or judgement is None:
        return {"status": str(record.status), "message": record.message}
    force, displacement, volume = judgement.force.value, judgement.displacement.value, VOLUME(run)
    shares = abs(force) / SOLID[0], displacement / SOLID[1], volume / LOST
    return {
        "status": str(record.status),
        "force_end [%]": force,
        "mean_error [%]": displacement,
        "volume_worst [%]": volume,
        COST: judgement.cost.value,
        SHARE: max(share for share in shares if not math.isnan(share)),  # the ball's displacement is prescribed
    }


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
