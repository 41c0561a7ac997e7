"""Data of one case, or of an external entry, for the page: texts, histories, and its surface next to that of the
reference."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from massspring import Capsule, Obstacle, Plane
from studies.base.counting import readable
from studies.exchange.entry import ENTRY, SECONDS, sides_of
from studies.metrics.metric import PERCENT
from studies.metrics.run import Run
from studies.report.page.pack import STEP, pack_frames, pack_indices, pack_series
from studies.report.page.reference_shape import MOST_NODES, from_rest, reference_id
from studies.runs.indicators import HEAVIER
from studies.scene.quantities import allowed
from studies.store.record import Status
from studies.store.schema import SURFACE

BINS = 40
"""Intervals of a history; the smallest and the largest value of each are shown."""
COMPARED = "surface"
"""Quantity that a scene must allow where points are to be compared: a body that may turn or slip has none."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Of a replay: positions [m] (P, v, 3) of the nodes (v,) of the outer surface at times [s] (P,)."""

    times: np.ndarray
    nodes: np.ndarray
    positions: np.ndarray
    straight: bool = False
    """Whether the times are the checkpoints alone, between which the page moves all points in straight lines."""


def case_data(run: Run, again: str) -> dict[str, Any]:
    """JSON-able; `again`: the command that repeats the run."""
    case, record = run.case, run.record
    law = f", law {readable(case.body.law)}" if case.body.law not in ("", "van_gelder") else ""
    title = f"{readable(case.scene.name)} · {case.body.series}{law}, {case.body.nodes} nodes · {case.method_words}"
    step = f"{1e3 * float(record.attributes['dt']):.3g} ms" if "dt" in record.attributes else "unknown"
    outcome = record.status if record.status == Status.OK else f"{record.status} ({record.message})"
    data = {
        "title": f"{title} · step {step}",
        "scene": case.scene.name,
        "about": f"{case.scene.title}. Time step {step}; it ended {outcome}.{masses(run)}",
        "again": again,
        "duration": case.scene.duration,
        "histories": histories(run),
    }
    if run.reference is not None:
        data["reference"] = reference_points(run)
    surface = recorded_surface(run) or checkpoint_surface(run)
    return data | ({"why": why_still(run)} if surface is None else {"replay": replay_of(run, surface)})


def masses(run: Run) -> str:
    """What a viewer must know of the motion of a body with other masses than its tissue's."""
    if run.case.body.mass == "lumped" or "heaviness" not in run.record.attributes:
        return ""
    times = float(run.record.attributes["heaviness"])
    heavy = f"{times:.3g} times as heavy as" if times > HEAVIER else "shared otherwise than"
    return f" Its inertia is {heavy} the tissue's: on the way it does not move as the organ does."


def recorded_surface(run: Run) -> Surface | None:
    """The surface where the case records it; None where it does not, or where it has too many nodes."""
    if "surface" not in run.record.fields or len(run.field("surface_node")) > MOST_NODES:
        return None
    frames, nodes, positions = (run.field(name) for name in SURFACE)
    return Surface(np.concatenate([[0.0], run.fields.t])[frames], nodes, positions.astype(float))


def checkpoint_surface(run: Run) -> Surface | None:
    """The surface at rest and at the checkpoints that were reached, which every record holds; None where no checkpoint
    was reached, or where it has too many nodes."""
    if "snapshots" not in run.record.fields:
        return None
    nodes, snapshots = np.unique(run.field("triangles")), run.field("snapshots")
    good = np.array([np.isfinite(positions).all() for positions in snapshots], bool)
    snapshots = snapshots[: int(np.logical_and.accumulate(good).sum()), nodes]
    if not len(snapshots) or len(nodes) > MOST_NODES:
        return None
    reached = np.array(run.case.scene.checkpoints[: len(snapshots)], float)
    times, positions = from_rest(run.case.scene, reached, run.field("rest")[nodes], snapshots)
    return Surface(times, nodes, positions, straight=True)


def why_still(run: Run) -> str:
    if not run.record.fields:
        return "Nothing was computed, so there is no replay."
    if not len(run.field("snapshots")):
        return "It ended before the first checkpoint, so no positions are stored and there is no replay."
    return f"Its surface has more than {MOST_NODES:,} nodes, so there is no replay."


def histories(run: Run) -> dict[str, Any]:
    """Volume, probed force and frame time, thinned; without those that were not measured."""
    if "t" not in run.record.fields:
        return {}
    series = {"volume": PERCENT * (run.volume_ratio - 1)}
    if probes_force(run):
        series["force"] = run.force
    if run.timing is not None:
        series["frame"] = 1e-6 * np.median(run.timing.frame_ns, axis=0)
    points = {name: thinned(run.fields.t, values) for name, values in series.items()}
    return {
        name: {"t": pack_series(t), "values": pack_series(values)} for name, (t, values) in points.items() if len(t)
    }


def probes_force(run: Run) -> bool:
    scene = run.case.scene
    return scene.probed.number < len(scene.obstacles if scene.probed.what == "obstacle" else scene.held)


def thinned(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The ends of both (n,), and of BINS stretches between the smallest and the largest value; finite ones alone."""
    t, values = (series[np.isfinite(values)] for series in (t, values))
    if len(t) <= 2 * BINS:
        return t, values
    indices = {0, len(t) - 1}
    for part in np.array_split(np.arange(len(t)), BINS):
        indices |= {int(part[np.argmin(values[part])]), int(part[np.argmax(values[part])])}
    samples = sorted(indices)
    return t[samples], values[samples]


def reference_points(run: Run) -> dict[str, list[float | None]]:
    """Volume [%] and force [N] of the reference at its checkpoints."""
    assert run.reference is not None
    series = {
        "t": run.reference.field("t"),
        "volume": PERCENT * (run.reference.field("volume") - 1),
        "force": run.reference.force,
    }
    return {name: [float(f"{v:.5g}") if np.isfinite(v) else None for v in values] for name, values in series.items()}


def replay_of(run: Run, surface: Surface) -> dict[str, Any]:
    """The surface of a run; where there is a reference, its id, and how far points are from their places in it."""
    nodes, times = surface.nodes, surface.times
    triangles = run.fields.triangles
    place = np.full(len(run.fields.rest), -1)
    place[nodes] = np.arange(len(nodes))
    frames = pack_frames(surface.positions, run.size)
    replay = {
        "times": [float(f"{t:.6g}") for t in times],
        "straight": surface.straight,
        "triangles": pack_indices(place[triangles[np.isin(triangles, nodes).all(axis=1)]]),
        "positions": frames,
        "obstacles": [obstacle_of(obstacle, times) for obstacle in run.case.scene.obstacles],
        "rounding": f"{PERCENT * max(0.5 * STEP, 0.5 * frames['step'] / run.size):.2g} %",
    }
    if run.reference is None:
        return replay
    comparable = allowed(run.case.scene, COMPARED)
    replay |= {"reference": reference_id(run.case.scene), "comparable": comparable}
    return replay | errors_of(run, nodes) if comparable else replay


def errors_of(run: Run, nodes: np.ndarray) -> dict[str, Any]:
    """Distances [m] of `nodes` (v,) from their places in the reference at all checkpoints that the run reached, one row
    after the other, before them those at rest; and the largest."""
    assert run.reference is not None  # the caller checked it
    rest, own, material = run.fields.rest[nodes], run.fields.snapshots[:, nodes], run.material_nodes
    # The metrics have asked for all of them, so their places in the reference need no second search.
    truth = run.reference.displacements(run.places[material])[: len(own), np.searchsorted(material, nodes)]
    error = np.linalg.norm(own - rest - truth, axis=-1)
    reached = np.array(run.case.scene.checkpoints[: len(own)], float)
    times, rows = from_rest(run.case.scene, reached, np.zeros(len(nodes)), error)
    return {
        "reached": times.tolist(),
        "errors": pack_series(rows.ravel()),
        "largest": float(error.max(initial=0.0, where=np.isfinite(error))),
    }


def obstacle_of(obstacle: Obstacle, times: np.ndarray) -> dict[str, Any]:
    """Where it is at `times` (P,) [s]; of a plane the unit normal, of all others radius and length of the axis [m]."""
    at = {"at": [[float(f"{x:.6g}") for x in obstacle.anchor + obstacle.path(float(t))] for t in times]}
    if isinstance(obstacle, Plane):
        return at | {"normal": obstacle.unit_normal.tolist()}
    span = obstacle.span.tolist() if isinstance(obstacle, Capsule) else [0.0, 0.0, 0.0]
    return at | {"radius": obstacle.radius, "span": span}


def merged(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    """Merges the data of the same case from two studies; recorded positions take precedence over those at
    checkpoints."""
    both = {**other, **one, "histories": {**other["histories"], **one["histories"]}}
    replays = [view["replay"] for view in (one, other) if "replay" in view]
    return both | {"replay": min(replays, key=lambda replay: replay["straight"])} if replays else both


def entry_data(run: Run, scene: str) -> dict[str, Any]:
    """JSON-able, as `case_data` has it of a case; `entry` holds the name. The replay is that of the checkpoints, which
    all entries hold on one of the scene's own meshes; one that handed nothing in has none. `scene`: as the command line
    takes it."""
    case, record, name = run.case, run.record, run.case.method.name
    outcome = record.status if record.status == Status.OK else f"{record.status} ({record.message})"
    file = str(record.attributes[ENTRY]).split(" sha256:")[0]
    again = f"organbench judge {scene} {file if record.fields else 'FILE'} --name {name}"
    seconds = record.attributes.get(SECONDS)
    data = {
        "title": f"{readable(case.scene.name)} · entry {name}, {sides_of(case)} mesh, {case.body.nodes} nodes",
        "entry": name,
        "scene": case.scene.name,
        "about": f"{case.scene.title}. Computed by another program and judged like our own runs; it ended {outcome}.",
        "again": again if seconds is None else f"{again} --seconds {seconds:g}",
        "duration": case.scene.duration,
        # Its computing time is a single number, which is in the table.
        "histories": {what: values for what, values in histories(run).items() if what != "frame"},
    }
    if run.reference is not None:
        data["reference"] = reference_points(run)
    surface = checkpoint_surface(run)
    return data | ({"why": why_still(run)} if surface is None else {"replay": replay_of(run, surface)})
