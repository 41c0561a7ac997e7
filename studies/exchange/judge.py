"""Evaluates the results of another program: volumes, elements and contacts are measured as in our runs, and the same
metrics use the record."""

import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from massspring.layout.face_pairs import faces_behind
from massspring.layout.probe_arrays import tip_depth
from massspring.sources import source_fingerprint
from massspring.world.obstacles import Obstacle, Probe
from studies.base.errors import StudyError
from studies.exchange.entry import ENTRY, SECONDS, entry_name, outside
from studies.exchange.fit import SAME, Fitting, fitted, force_at
from studies.exchange.handed import read_force, read_handed
from studies.exchange.meshes import GivenMesh, given_meshes
from studies.exchange.precut import given_scene
from studies.runs.case import Case
from studies.runs.indicators import sway
from studies.runs.prepare import LUMEN
from studies.scene.scene import Scene
from studies.store.new_record import new_fields, new_record
from studies.store.record import Record, Status
from studies.store.schema import RUN_FIELDS

STILL = "the body did not move"
"""Warning of an entry whose positions are those at rest in every step."""


def entry_record(
    scene: Scene, path: Path, name: str, nodes: int, force: Path | None = None, seconds: float | None = None
) -> Record:
    """The record of the results of another program.

    path: as handed.read_handed takes it; name: of the entry; nodes: vertices on the outer surface with which the scene
    was exported; force: a CSV file with the probed force; seconds: computing time for a simulated second [s/s].
    Raises StudyError for anything that does not fit the scene.
    """
    method, scene = outside(name), given_scene(scene)
    if seconds is not None and not 0.0 < seconds < np.inf:
        raise StudyError(f"{seconds} s of computing for a simulated second is not a time; give a positive number")
    handed = read_handed(path)
    fitting = fitted(handed, scene, given_meshes(scene, nodes)[0])
    if force is not None:
        if "force" in fitting.histories:
            raise StudyError(f"{handed.name} already has the force; leave out {force.name}")
        fitting.histories["force"] = force_at(force.name, fitting.t, *read_force(force), scene)
    case = Case(scene, fitting.mesh.recipe, method)
    values = measured(fitting)
    inverted = values["min_j"][-1] <= 0.0
    return new_record(
        kind="run",
        key=case.key,
        name=entry_name(case),
        status=Status.INVERTED if inverted else Status.OK,
        message="an element is inverted at the end" if inverted else "",
        fingerprint=source_fingerprint(__name__),
        attributes=_attributes(fitting) | _sway(fitting, values) | {ENTRY: _named(path, fitting), SECONDS: seconds},
        fields=new_fields(RUN_FIELDS, values),
    )


def measured(fitting: Fitting) -> dict[str, np.ndarray]:
    """The fields of a record, computed from the positions."""
    mesh, t, x = fitting.mesh, fitting.t, fitting.positions
    scene, body, steps = mesh.scene, mesh.body, len(fitting.t)
    at = [int(np.argmin(np.abs(t - checkpoint))) for checkpoint in scene.checkpoints]
    surface, names = body.surface_nodes, mesh.volumes.names
    depth = [[_depth(obstacle, each, surface, body.triangles, float(when)) for obstacle in scene.obstacles]
             for when, each in zip(t, x, strict=True)]  # fmt: skip
    pressure = np.zeros((steps, len(names)))
    for column, name in enumerate(names):
        pressure[:, column] = fitting.histories.get("lumen_pressure" if name == LUMEN else "pressure", 0.0)
    return {
        "t": t,
        "volume": np.array([mesh.volumes.measure(each) for each in x]),
        "volume_target": mesh.volume_targets(t),
        "pressure": pressure,
        **_forces(scene, fitting.histories.get("force"), steps),
        "penetration": np.array(depth).reshape(steps, len(scene.obstacles)),
        "iterations": np.zeros((steps, 2), dtype=np.int64),
        "min_j": np.array([body.smallest_ratio(each) for each in x]),
        "snapshot_frame": np.array(at) + 1,
        "snapshots": x[at],
        "rest": body.rest,
        "mass": body.mass,
        "triangles": body.triangles,
        "tetrahedra": body.tetrahedra,
        **_cut(mesh),
    }


def _cut(mesh: GivenMesh) -> dict[str, np.ndarray]:
    """The faces of a body that is cut; each kept volume is a piece."""
    if mesh.scene.cut is None:
        return {}
    faces = faces_behind(mesh.body.triangles.astype(np.int64), mesh.pairs, len(mesh.points))
    return {"cut_faces": faces, "cut_pairs": mesh.pairs, "cut_parts": np.arange(len(mesh.volumes.names))}


def _depth(obstacle: Obstacle, x: np.ndarray, surface: np.ndarray, triangles: np.ndarray, t: float) -> float:
    """How deep the deepest surface node lies in an obstacle [m]."""
    if isinstance(obstacle, Probe):
        return max(0.0, tip_depth(obstacle, x, triangles, t))
    return max(0.0, -float(obstacle.gap(x[surface], t).min()))


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
    mesh, steps = fitting.mesh, len(fitting.t)
    names = mesh.volumes.names
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
        "warnings": "" if _has_moved(fitting) else STILL,
    } | ({} if mesh.scene.cut is None else {"cut_frame": 0})


def _has_moved(fitting: Fitting) -> bool:
    rest = fitting.mesh.points
    size = np.linalg.norm(np.ptp(rest, axis=0))
    return bool(np.linalg.norm(fitting.positions - rest, axis=-1).max() > SAME * size)


def _sway(fitting: Fitting, values: dict[str, np.ndarray]) -> dict[str, float]:
    """The variation of the force at the end; NaN if unknown."""
    if "force" not in fitting.histories:
        return {}
    return {"sway": sway(fitting.mesh.scene, values["t"], values["contact_force"], values["held_force"])}


def _named(path: Path, fitting: Fitting) -> str:
    digest = hashlib.sha256(np.ascontiguousarray(fitting.positions).tobytes()).hexdigest()
    return f"{path.name} sha256:{digest}"


def unfinished_record(case: Case, status: Status, message: str) -> Record:
    """The record of an entry without results; `status` and `message` give the reason."""
    return new_record(
        kind="run",
        key=case.key,
        name=entry_name(case),
        status=status,
        message=message,
        fingerprint=source_fingerprint(__name__),
        attributes={ENTRY: "nothing was handed in"},
        fields={},
    )
