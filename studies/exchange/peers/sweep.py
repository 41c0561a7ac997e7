"""The settings of every program: a small sweep on one scene, whose best are then taken for all others.

`python -m studies.exchange.peers.main --sweep` writes the table; PEERS has what it chose.
"""

import json
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
from studies.scene.library import LIVER_PRESS
from studies.store.record import Record, Status

SCENE, NODES = LIVER_PRESS, 150
"""It has a force and a displacement, a hold, and a plane, which every program knows."""
SHARE = "share of the target [1]"
"""The largest of the errors of force, displacement and volume, over what is usually enough. One scene tells little of
another: with a Poisson ratio of 0.3 coarse tetrahedra lock less, and lose 2 % of the volume here, but 8 to 11 % of that
of a squeezed ball."""
VOLUME, LOST = metric("volume_worst"), 1.0
"""Error of the volume [%] that is usually enough."""
GRIDS: dict[str, tuple[dict[str, Any], ...]] = {
    "mujoco": ({}, {"poisson": 0.45}, {"poisson": 0.4}, {"poisson": 0.3}),
    "felupe": ({}, {"penalty": 10.0}),
    "newton": ({}, {"lame": 9.0}, {"lame": 4.0}, {"lame": 1.5}),
    "bullet": ({}, {"lame": 4.0}, {"lame": 1.5}),
    "drake": ({}, {"poisson": 0.45}, {"poisson": 0.4}, {"poisson": 0.3}),
    "sfepy": ({}, {"increments": 1}, {"penalty": 500.0}),
}
"""What is tried of each; {} are the settings with which its adapter is written."""


def swept(peer: Peer, folder: Path, limit: float, environments: Path) -> Iterator[dict[str, Any]]:
    """A row for each of its settings, with the scene exported into `folder`. Raises StudyError where that fails."""
    given = folder / f"{SCENE.name}-{NODES}"
    if not given.exists():
        export(SCENE, given, NODES)
    for settings in GRIDS.get(peer.name, ({},)):
        record = judged(Attempt(replace(peer, settings=settings), SCENE, NODES), given, limit, environments)
        yield {"engine": peer.name, "settings": json.dumps(settings)} | _numbers(record)


def _numbers(record: Record) -> dict[str, Any]:
    run = run_of_entry(record, reference_for(Path(), SCENE)) if record.status == Status.OK else None
    found = None if run is None else judged_run(run)
    if run is None or found is None:
        return {"status": str(record.status), "message": record.message}
    force, displacement, volume = found.force.value, found.displacement.value, VOLUME(run)
    return {
        "status": str(record.status),
        "force_end [%]": force,
        "mean_error [%]": displacement,
        "volume_worst [%]": volume,
        "cost [s/s]": found.cost.value,
        SHARE: max(abs(force) / SOLID[0], displacement / SOLID[1], volume / LOST),
    }


def best(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any] | None:
    """The settings of the smallest share of the target among rows of a program; None where none ended well."""
    ended = [row for row in rows if row.get(SHARE) is not None and row[SHARE] == row[SHARE]]
    return json.loads(min(ended, key=lambda row: row[SHARE])["settings"]) if ended else None
