"""What the page shows of one case: words, histories, and its surface beside that of the reference."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from massspring import Capsule, Obstacle, Plane
from studies.metrics.metric import PERCENT
from studies.metrics.run import Run
from studies.plots.style.style import readable
from studies.reference.load import Reference
from studies.report.page.pack import STEP, pack_frames, pack_indices, pack_series
from studies.scene.quantities import allowed
from studies.store.record import Status
from studies.store.schema import SURFACE

BINS = 40
"""Stretches of a history; of each the smallest and the largest value are shown."""
MOST_NODES = 65_535
"""Numbers of nodes have two bytes on the page."""
COMPARED = "surface"
"""Quantity that a scene must allow where points are to be compared: a body that may turn or slip has none."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Of a replay: positions [m] (P, v, 3) of the nodes (v,) of the outer surface at times [s] (P,)."""

    times: np.ndarray
    nodes: np.ndarray
    positions: np.ndarray


@dataclass
class Truths:
    """Displacements of references at points of the organ, which are found once for all runs on one mesh."""

    known: dict[tuple[int, bytes], np.ndarray] = field(default_factory=dict)

    def displacements(self, reference: Reference, points: np.ndarray) -> np.ndarray:
        """Of `points` (n, 3) [m] at every checkpoint [m], (K, n, 3)."""
        key = id(reference), points.tobytes()
        if key not in self.known:
            self.known[key] = reference.displacements(points)
        return self.known[key]


def case_data(run: Run, path: Path, truths: Truths) -> dict[str, Any]:
    """JSON-able; `path`: the file that holds the run, as it is named in the command that repeats it."""
    case, record = run.case, run.record
    law = f", law {readable(case.body.law)}" if case.body.law != "van_gelder" else ""
    title = f"{readable(case.scene.name)} · {case.body.series}{law}, {case.body.nodes} nodes · {case.method_words}"
    step = f"{1e3 * float(record.attributes['dt']):.3g} ms" if "dt" in record.attributes else "unknown"
    ended = record.status if record.status == Status.OK else f"{record.status} ({record.message})"
    found = {
        "title": f"{title} · step {step}",
        "scene": case.scene.name,
        "about": f"{case.scene.title}. Time step {step}; it ended {ended}.",
        "again": f"organbench replay {path}",
        "duration": case.scene.duration,
        "histories": histories(run),
        "why": "Of this case no positions are recorded beside those at checkpoints, so there is no replay.",
    }
    if run.reference is not None:
        found["reference"] = reference_points(run)
    if run.fields.surface_node is not None and len(run.fields.surface_node) <= MOST_NODES:
        frames, nodes, positions = (run.field(name) for name in SURFACE)
        times = np.concatenate([[0.0], run.fields.t])[frames]
        found["replay"] = replay_of(run, Surface(times, nodes, positions.astype(float)), truths)
    return found


def histories(run: Run) -> dict[str, Any]:
    """Volume, probed force and frame time, thinned; without those that were not measured."""
    if "t" not in run.record.fields:
        return {}
    found = {"volume": PERCENT * (run.volume_ratio - 1)}
    if probes_force(run):
        found["force"] = run.force
    if run.timing is not None:
        found["frame"] = 1e-6 * np.median(run.timing.frame_ns, axis=0)
    shown = {name: thinned(run.fields.t, values) for name, values in found.items()}
    return {name: {"t": pack_series(t), "values": pack_series(values)} for name, (t, values) in shown.items() if len(t)}


def probes_force(run: Run) -> bool:
    """Whether what the scene probes is there: bodies that only fall have no obstacle and are held nowhere."""
    scene = run.case.scene
    return scene.probed.number < len(scene.obstacles if scene.probed.what == "obstacle" else scene.held)


def thinned(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The ends of both (n,), and of BINS stretches between the smallest and the largest value; finite ones alone."""
    t, values = (series[np.isfinite(values)] for series in (t, values))
    if len(t) <= 2 * BINS:
        return t, values
    kept = {0, len(t) - 1}
    for part in np.array_split(np.arange(len(t)), BINS):
        kept |= {int(part[np.argmin(values[part])]), int(part[np.argmax(values[part])])}
    chosen = sorted(kept)
    return t[chosen], values[chosen]


def reference_points(run: Run) -> dict[str, list[float | None]]:
    """Volume [%] and force [N] of the reference at its checkpoints."""
    assert run.reference is not None
    found = {
        "t": run.reference.field("t"),
        "volume": PERCENT * (run.reference.field("volume") - 1),
        "force": run.reference.force,
    }
    return {name: [float(f"{v:.5g}") if np.isfinite(v) else None for v in values] for name, values in found.items()}


def replay_of(run: Run, surface: Surface, truths: Truths) -> dict[str, Any]:
    """The surface of a run, and that of the reference at the same points of the organ at rest."""
    nodes, times = surface.nodes, surface.times
    triangles = run.fields.triangles
    place = np.full(len(run.fields.rest), -1)
    place[nodes] = np.arange(len(nodes))
    packed = pack_frames(surface.positions, run.size)
    found = {
        "times": [float(f"{t:.6g}") for t in times],
        "triangles": pack_indices(place[triangles[np.isin(triangles, nodes).all(axis=1)]]),
        "positions": packed,
        "obstacles": [obstacle_of(obstacle, times) for obstacle in run.case.scene.obstacles],
        "rounding": f"{PERCENT * max(0.5 * STEP, 0.5 * packed['step'] / run.size):.2g} %",
    }
    if run.reference is None:
        return found
    rest = run.fields.rest[nodes]
    checkpoints, truth = np.asarray(run.reference.field("t"), float), rest + truths.displacements(run.reference, rest)
    comparable = allowed(run.case.scene, COMPARED)
    largest = largest_error(run, nodes, truth) if comparable else 0.0
    checkpoints, truth = from_rest(run, checkpoints, rest, truth)
    return found | {
        "checkpoints": checkpoints.tolist(),
        "reference": pack_frames(truth, run.size),
        "comparable": comparable,
        "largest": largest,
    }


def obstacle_of(obstacle: Obstacle, times: np.ndarray) -> dict[str, Any]:
    """Where it is at `times` (P,) [s]; of a plane the unit normal, of all others radius and length of the axis [m]."""
    at = {"at": [[float(f"{x:.6g}") for x in obstacle.anchor + obstacle.path(float(t))] for t in times]}
    if isinstance(obstacle, Plane):
        return at | {"normal": obstacle.unit_normal.tolist()}
    span = obstacle.span.tolist() if isinstance(obstacle, Capsule) else [0.0, 0.0, 0.0]
    return at | {"radius": obstacle.radius, "span": span}


def from_rest(run: Run, t: np.ndarray, rest: np.ndarray, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times (K,) [s] and positions (K, v, 3) [m], before them those at rest (v, 3), where the scene begins there."""
    if run.case.scene.start is not None or t[0] <= 0:
        return t, positions
    return np.concatenate([[0.0], t]), np.concatenate([rest[None], positions])


def largest_error(run: Run, nodes: np.ndarray, truth: np.ndarray) -> float:
    """Largest distance [m] of `nodes` (v,) from their places in the reference (K, v, 3) [m], at all checkpoints that
    the run reached."""
    own = run.fields.snapshots[:, nodes]
    return float(np.linalg.norm(own - truth[: len(own)], axis=-1).max(initial=0.0))


def merged(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    """Two views of the same case, of two studies: what one lacks, the other has."""
    return {**other, **one, "histories": {**other["histories"], **one["histories"]}}
