"""Evaluates the results of another program: volumes, elements and contacts are measured as in our runs, and the same
metrics use the record."""

import hashlib
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from massspring import Body
from massspring.layout.face_pairs import faces_behind
from massspring.layout.probe_arrays import tip_depth
from massspring.sources import source_fingerprint
from massspring.world.depth import deepest
from massspring.world.obstacles import Obstacle, Plane, Probe
from studies.base.errors import StudyError
from studies.exchange.entry import ENTRY, SECONDS, entry_name, entry_path, outside, run_of_entry
from studies.exchange.fit import SAME, Fitting, fitted, force_at
from studies.exchange.handed import read_force, read_handed
from studies.exchange.league import LEAGUE, EntryFile, check_entry, mesh_of_entry, read_entry_file
from studies.exchange.meshes import NODES, given_meshes, given_scene
from studies.metrics.run import Run
from studies.reference.load import reference_for
from studies.runs.case import Case
from studies.runs.crossing import crossed
from studies.runs.indicators import CROSSED, sway, through_itself
from studies.runs.prepare import LUMEN
from studies.runs.status import crossing, folding, tunnelling
from studies.scene.scene import Scene
from studies.store.record import Record, Status, new_fields, new_record, write_record
from studies.store.schema import RUN_FIELDS

STILL = "the body did not move"
"""Warning of an entry whose positions are those at rest in every step."""


def judge(
    scene: Scene,
    file: Path,
    results: Path = Path("results"),
    *,
    name: str = "",
    nodes: int = NODES,
    force: Path | None = None,
    seconds: float | None = None,
) -> Run:
    """What another program computed, judged as our own runs are and kept with them below `results`.

    file: npz, CSV, VTKHDF or PVD, a folder of VTU files, a pattern, or an entry of the league (JSON), which says all of
    the rest itself; name: of the entry, by default that of the file; nodes: vertices on the outer surface with which
    the scene was exported; force: a CSV file with the probed force [N]; seconds: computing time for a simulated second
    [s/s]. Without the reference of the scene a warning, and no errors. Raises StudyError for anything that does not
    fit the scene; nothing is kept then.
    """
    if file.suffix.lower() != ".json":
        named = name or (file.parent if "*" in file.name else file).stem
        record = entry_record(scene, file, named, nodes, force, seconds)
    elif name or force is not None or seconds is not None:
        raise StudyError(f"{file.name} says all about the entry itself; leave out --name, --force and --seconds")
    else:
        record = league_record(scene, read_entry_file(file), file.parent)
    try:
        reference = reference_for(results, scene)
    except StudyError as problem:
        warnings.warn(f"errors are not judged, because the reference is missing: {problem}", stacklevel=2)
        reference = None
    run = run_of_entry(record, reference)
    write_record(judged_path(results, run), record)
    return run


def judged_path(results: Path, run: Run) -> Path:
    """Where `judge` keeps an entry: those of the league lie apart, for they are shown on a page of their own."""
    return entry_path(results / LEAGUE if LEAGUE in run.record.attributes else results, run.case)


def entry_record(
    scene: Scene, path: Path, name: str, nodes: int, force: Path | None = None, seconds: float | None = None
) -> Record:
    """The record of the results of another program. Raises StudyError for anything that does not fit the scene."""
    method, scene = outside(name), given_scene(scene)
    if seconds is not None and not 0.0 < seconds < np.inf:
        raise StudyError(f"{seconds} s of computing for a simulated second is not a time; give a positive number")
    handed = read_handed(path)
    fitting = fitted(handed, scene, given_meshes(scene, nodes)[0])
    if force is not None:
        if "force" in fitting.histories:
            raise StudyError(f"{handed.name} already has the force; leave out {force.name}")
        fitting.histories["force"] = force_at(force.name, fitting.t, *read_force(force), scene)
    values = measured(fitting)
    digest = hashlib.sha256(np.ascontiguousarray(fitting.positions).tobytes()).hexdigest()
    about = {ENTRY: f"{path.name} sha256:{digest}", SECONDS: seconds}
    if "force" in fitting.histories:  # how much it varies at the end
        about["sway"] = sway(scene, values["t"], values["contact_force"], values["held_force"])
    itself = crossed(values["triangles"], values["rest"], values["snapshots"])
    about |= {"crossed": itself} | ({"warnings": through_itself(itself)} if 0.0 < itself <= CROSSED else {})
    status, message = folding(values["min_j"], shaped=scene.start is not None and scene.start.shaped)
    if status == Status.OK:
        status, message = crossing(itself)
    slipped = tunnelling(values["inside"])
    status, message = (Status.TUNNELLED, slipped) if slipped else (status, message)
    return _record(Case(scene, fitting.mesh.recipe, method), status, message, _attributes(fitting) | about, values)


def league_record(scene: Scene, entry: EntryFile, folder: Path) -> Record:
    """The record of an entry of the league whose result lies in `folder`; of one that has none, its reason. Raises
    StudyError for anything that does not fit the set or the scene."""
    check_entry(entry, scene.name)
    mesh = mesh_of_entry(entry, scene)
    if entry.result:
        record = entry_record(scene, folder / entry.result, entry.engine, entry.nodes, seconds=entry.seconds)
    else:
        status = Status.SKIPPED if entry.skipped else Status.FAILED
        case = Case(scene, mesh.recipe, outside(entry.engine))
        record = unfinished_record(case, status, entry.skipped or entry.failed)
    return replace(record, attributes=record.attributes | {LEAGUE: entry.model_dump_json()})


def unfinished_record(case: Case, status: Status, message: str) -> Record:
    """The record of an entry without results; `status` and `message` give the reason."""
    return _record(case, status, message, {ENTRY: "nothing was handed in"}, {})


def _record(
    case: Case, status: Status, message: str, attributes: dict[str, Any], values: dict[str, np.ndarray]
) -> Record:
    return new_record(
        kind="run",
        key=case.key,
        name=entry_name(case),
        status=status,
        message=message,
        fingerprint=source_fingerprint(__name__),
        attributes=attributes,
        fields=new_fields(RUN_FIELDS, values) if values else {},
    )


def measured(fitting: Fitting) -> dict[str, np.ndarray]:
    """The fields of a record, computed from the positions."""
    mesh, t, x = fitting.mesh, fitting.t, fitting.positions
    scene, body, steps = mesh.scene, mesh.body, len(fitting.t)
    at = [int(np.argmin(np.abs(t - checkpoint))) for checkpoint in scene.checkpoints]
    names, moments = mesh.volumes.names, list(zip(x, t.tolist(), strict=True))
    depths = [[_depth(obstacle, body, each, when) for obstacle in scene.obstacles] for each, when in moments]
    depth, inside = np.array(depths).reshape(steps, len(scene.obstacles), 2).transpose(2, 0, 1)
    pressure = np.zeros((steps, len(names)))
    for column, name in enumerate(names):
        pressure[:, column] = fitting.histories.get("lumen_pressure" if name == LUMEN else "pressure", 0.0)
    fields = {
        "t": t,
        "volume": np.array([mesh.volumes.measure(each) for each in x]),
        "volume_target": mesh.volume_targets(t),
        "pressure": pressure,
        **_forces(scene, fitting.histories.get("force"), steps),
        "penetration": depth,
        "inside": inside.astype(np.int64),
        "iterations": np.zeros((steps, 2), dtype=np.int64),
        "min_j": np.array([body.measured(each).least_j for each in x]),
        "snapshot_frame": np.array(at) + 1,
        "snapshots": x[at],
        "rest": body.rest,
        "mass": body.mass,
        "triangles": body.triangles,
        "tetrahedra": body.tetrahedra,
    }
    if scene.cut is not None:  # each kept volume is a piece
        fields["cut_faces"] = faces_behind(body.triangles.astype(np.int64), mesh.pairs, len(mesh.points))
        fields |= {"cut_pairs": mesh.pairs, "cut_parts": np.arange(len(names))}
    return fields


def _depth(obstacle: Obstacle, body: Body, x: np.ndarray, t: float) -> tuple[float, bool]:
    """How deep the deepest point of the surface lies in an obstacle [m], in a plane the deepest node; and whether the
    middle of a sphere or capsule is inside the body. What happens between steps is not seen."""
    if isinstance(obstacle, Probe):
        return max(0.0, tip_depth(obstacle, x, body.triangles, t)), False
    if isinstance(obstacle, Plane):
        return max(0.0, -float(obstacle.gap(x[body.surface_nodes], t).min())), False
    depth, inside = deepest(obstacle, x, body.facets, body.triangles, t)
    return max(0.0, depth), inside


def _forces(scene: Scene, force: np.ndarray | None, steps: int) -> dict[str, np.ndarray]:
    """Contact and held forces with the probed force along its direction; all others, and the probed one if none was
    submitted, are NaN."""
    contact, held = (np.full((steps, len(things), 3), np.nan) for things in (scene.obstacles, scene.held))
    if force is not None:
        direction = np.asarray(scene.probed.direction)
        among = contact if scene.probed.what == "obstacle" else held
        among[:, scene.probed.number] = force[:, None] * direction / (direction @ direction)
    return {"contact_force": contact, "held_force": held}


def _attributes(fitting: Fitting) -> dict[str, Any]:
    mesh, steps, rest = fitting.mesh, len(fitting.t), fitting.mesh.points
    names = mesh.volumes.names
    moved = np.linalg.norm(fitting.positions - rest, axis=-1).max() > SAME * np.linalg.norm(np.ptp(rest, axis=0))
    return {
        "rest_volume": mesh.body.volume,
        "dt": float("nan"),
        "dt_limit": float("nan"),
        "steps": 0,
        "frame": mesh.scene.duration / steps,
        "frames": steps,
        "good_frames": steps,
        "nodes": len(mesh.points),
        "springs": 0,
        "triangles": len(mesh.body.triangles),
        "law": "",
        "skipped_steps": 0,
        "capped_steps": 0,
        "volumes": len(names),
        "lumen_column": names.index(LUMEN) if LUMEN in names else -1,
        "warnings": "" if moved else STILL,
    } | ({} if mesh.scene.cut is None else {"cut_frame": 0})
