"""What the page shows of an entry from outside: who made it, its histories, and its body at the checkpoints."""

from typing import Any

import numpy as np

from studies.exchange.entry import ENTRY
from studies.metrics.run import Run
from studies.plots.style.style import readable
from studies.report.page.case_data import MOST_NODES, Surface, Truths, from_rest, histories, reference_points, replay_of
from studies.store.record import Status

WHY = "Of this entry no positions are stored that can be drawn, so there is no replay."


def entry_data(run: Run, truths: Truths) -> dict[str, Any]:
    """JSON-able, as `case_data` has it of a case; `entry` holds the name. The replay is that of the checkpoints, which
    all entries hold on one of the scene's own meshes; one that handed nothing in has none."""
    case, record, name = run.case, run.record, run.case.method.name
    mesh = "curved" if case.body.kind == "quadratic" else "straight"
    ended = record.status if record.status == Status.OK else f"{record.status} ({record.message})"
    file = str(record.attributes[ENTRY]).split(" sha256:")[0]
    found = {
        "title": f"{readable(case.scene.name)} · entry {name}, {mesh} mesh, {case.body.nodes} nodes",
        "entry": name,
        "scene": case.scene.name,
        "about": f"{case.scene.title}. Computed by another program and judged like our own runs; it ended {ended}.",
        "again": f"organbench judge {case.scene.name} {file if record.fields else 'FILE'} --name {name}",
        "duration": case.scene.duration,
        # One number is known of its computing time: it stands in the table.
        "histories": {what: values for what, values in histories(run).items() if what != "frame"},
        "why": WHY,
    }
    if run.reference is not None:
        found["reference"] = reference_points(run)
    surface = surface_of(run)
    return found if surface is None else found | {"replay": replay_of(run, surface, truths)}


def surface_of(run: Run) -> Surface | None:
    """What was handed in of the surface; None where that is nothing, or too much."""
    if "snapshots" not in run.record.fields:
        return None
    nodes = np.unique(run.field("triangles"))
    if len(nodes) > MOST_NODES:
        return None
    checkpoints = np.array(run.case.scene.checkpoints, float)
    times, positions = from_rest(run, checkpoints, run.field("rest")[nodes], run.field("snapshots")[:, nodes])
    return Surface(times, nodes, positions)
