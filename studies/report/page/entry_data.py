"""What the page shows of an entry from outside: who made it, its histories, and its body at the checkpoints."""

from typing import Any

from studies.base.counting import readable
from studies.exchange.entry import ENTRY
from studies.metrics.run import Run
from studies.report.page.case_data import (
    checkpoint_surface,
    histories,
    reference_points,
    replay_of,
    why_still,
)
from studies.store.record import Status


def entry_data(run: Run, scene: str) -> dict[str, Any]:
    """JSON-able, as `case_data` has it of a case; `entry` holds the name. The replay is that of the checkpoints, which
    all entries hold on one of the scene's own meshes; one that handed nothing in has none. `scene`: as the command line
    takes it."""
    case, record, name = run.case, run.record, run.case.method.name
    mesh = "curved" if case.body.kind == "quadratic" else "straight"
    ended = record.status if record.status == Status.OK else f"{record.status} ({record.message})"
    file = str(record.attributes[ENTRY]).split(" sha256:")[0]
    found = {
        "title": f"{readable(case.scene.name)} · entry {name}, {mesh} mesh, {case.body.nodes} nodes",
        "entry": name,
        "scene": case.scene.name,
        "about": f"{case.scene.title}. Computed by another program and judged like our own runs; it ended {ended}.",
        "again": f"organbench judge {scene} {file if record.fields else 'FILE'} --name {name}",
        "duration": case.scene.duration,
        # One number is known of its computing time: it stands in the table.
        "histories": {what: values for what, values in histories(run).items() if what != "frame"},
    }
    if run.reference is not None:
        found["reference"] = reference_points(run)
    surface = checkpoint_surface(run)
    return found | ({"why": why_still(run)} if surface is None else {"replay": replay_of(run, surface)})
