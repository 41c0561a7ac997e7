"""Runs one case: prepares, simulates, determines the status, stores the record. Any failure is recorded as a result;
only a failure to store raises."""

import json
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from massspring import History, MassSpringError, simulate
from studies.base.compile_watch import watching
from studies.base.errors import DoesNotApply, StudyError
from studies.geometry.mesh.organ_mesh import tetrahedron_volumes
from studies.runs.case import Case, case_from_json
from studies.runs.crossing import crossed
from studies.runs.current import case_fingerprint, case_path
from studies.runs.cutting import LUMEN
from studies.runs.indicators import indicators, remarks, resting_frames
from studies.runs.limits import TIME_LIMIT
from studies.runs.outlines import missed_at_outlines, regions
from studies.runs.prepare import Prepared, prepare
from studies.runs.status import status_of
from studies.runs.surface_frames import moments, surface_fields
from studies.runs.user_code import fault_of, files_of
from studies.scene.checks import check_scene
from studies.scene.scene import Scene
from studies.store.record import Field, Record, Status, json_in, new_fields, new_record, read_record, write_record
from studies.store.schema import RUN_FIELDS

OWN_FILES = "own_files"
"""Attribute of a run: the user's files that it was made with, as JSON {path: SHA-256}."""


def run_case(root: Path, study: str, case: Case, on_frame: Callable[[int], object] | None = None) -> Path:
    """Runs a case and stores its record, also for a failure, with the time that it took without compiling [s].

    Raises StudyError only if the record cannot be stored."""
    path = case_path(root, study, case)
    started = time.perf_counter()
    with watching() as watch:
        record = record_of(case, on_frame)  # the command has checked its scenes
    seconds = time.perf_counter() - started - watch.seconds
    write_record(path, replace(record, attributes={**record.attributes, "seconds": seconds}))
    return path


def measure(case: Case, on_frame: Callable[[int], object] | None = None) -> Record:
    """The record of a case, also of one whose scene cannot start; its attribute `warnings` holds what is unusual about
    the scene, and the warnings of its preparation."""
    return record_of(case, on_frame, check_scene)


def record_of(
    case: Case,
    on_frame: Callable[[int], object] | None = None,
    check: Callable[[Scene], Sequence[str]] = lambda scene: (),
) -> Record:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        try:
            for sentence in check(case.scene):
                warnings.warn(sentence, stacklevel=2)
            prepared = prepare(case)
            # Attachments that overlap, or hold no node, are detected only when the run starts.
            history = simulate(prepared.setup, snapshot_frames(case, prepared), on_frame, TIME_LIMIT)
        except DoesNotApply as reason:
            return _record(case, Status.SKIPPED, str(reason), {"warnings": _warning_text(caught)}, {})
        except (StudyError, MassSpringError) as error:
            return _record(case, Status.FAILED, str(error), {"warnings": _warning_text(caught)}, {})
        except Exception as error:  # a user's code may raise any exception
            own = fault_of(error)
            if own is None:
                raise
            return _record(case, Status.FAILED, own, {"warnings": _warning_text(caught)}, {})
    fields = _fields(case, prepared, history)
    itself = float("nan")
    if history.outcome == "finished":
        itself = crossed(*(fields[name].values for name in ("triangles", "rest", "snapshots")))
    status, message = status_of(case, history, itself)
    keeps = case.method.volume_tol is not None
    clock = prepared.setup.clock
    signs = indicators(case.scene, prepared.body, history, _lumen_column(prepared), keeps, clock.steps)
    end, held = history.final, prepared.setup.attachments
    places = [] if prepared.opening else regions(case.scene, prepared.body, held, end, float(history.t[-1]))
    signs |= {"missed_at_outlines": missed_at_outlines(prepared.body, places, end), "crossed": itself}
    odd = remarks(case.scene, signs, uniform=not case.body.graded)
    text = "; ".join(filter(None, [_warning_text(caught), *odd]))
    attributes = {**_attributes(prepared, history), **signs, "warnings": text}
    return _record(case, status, message, attributes, fields)


def _warning_text(caught: list[warnings.WarningMessage]) -> str:
    return "; ".join(dict.fromkeys(str(w.message) for w in caught if issubclass(w.category, UserWarning)))


def checkpoint_frames(case: Case, prepared: Prepared) -> list[int]:
    """Numbers (1 … F) of the frames that end at the scene's checkpoints."""
    clock = prepared.setup.clock
    return [min(clock.frames, max(1, round(t / clock.frame))) for t in case.scene.checkpoints]


def snapshot_frames(case: Case, prepared: Prepared) -> list[int]:
    """Numbers of the frames after which positions are kept: those at checkpoints, those that tell whether the body
    rests, and those at which the surface is recorded."""
    clock, at = prepared.setup.clock, checkpoint_frames(case, prepared)
    shown = moments(clock.frames, at) if "surface" in case.recorded else at
    return sorted({*shown, *resting_frames(case.scene, clock.frame * np.arange(1, clock.frames + 1))})


def _record(case: Case, status: Status, message: str, attributes: dict, fields: dict[str, Field]) -> Record:
    own = {str(file.path): file.sha256 for file in files_of(case)}
    return new_record(
        kind="run",
        key=case.key,
        name=case.name,
        status=status,
        message=message,
        fingerprint=case_fingerprint(case),
        attributes=attributes | ({OWN_FILES: json.dumps(own)} if own else {}),
        fields=fields,
    )


def _attributes(prepared: Prepared, history: History) -> dict[str, float | int | str]:
    clock, body, cut = prepared.setup.clock, prepared.body, prepared.opening
    shown = None if prepared.tissue is None else prepared.tissue.mesh
    heavy = {} if prepared.heaviness is None else prepared.heaviness.record
    return (
        heavy
        | {
            "rest_volume": body.volume,
            "dt": clock.dt,
            "dt_limit": prepared.limit.damped,
            "steps": clock.steps,
            "frame": clock.frame,
            "frames": clock.frames,
            "good_frames": history.good_frames,
            "nodes": body.node_count if shown is None else len(shown.points),
            "springs": body.springs.count,
            "triangles": len(body.triangles if shown is None else shown.triangles),
            "law": body.law,
            "skipped_steps": history.singular_steps,
            "capped_steps": history.limited_corrections,
            "volumes": body.kept.count,
            "lumen_column": _lumen_column(prepared),
        }
        | ({} if cut is None else {"cut_frame": cut.frame, **_event_attributes(prepared, history)})
    )


def _event_attributes(prepared: Prepared, history: History) -> dict[str, float]:
    """The effects of a cut, the largest over its events; for a run that ended before it only its effect on the step."""
    before = prepared.limit_before
    assert before is not None  # it is cut
    attributes = {"cut_limit_ratio": prepared.limit.damped / before.damped, "cut_events": len(prepared.setup.events)}
    if history.passages:
        attributes |= {
            "cut_energy": max(one.energy for one in history.passages),
            "cut_momentum": max(one.momentum for one in history.passages),
            "cut_seconds": 1e-9 * max(one.ns for one in history.passages),
        }
    return attributes


def _lumen_column(prepared: Prepared) -> int:
    names = prepared.body.kept.names
    return names.index(LUMEN) if LUMEN in names else -1


def _fields(case: Case, prepared: Prepared, history: History) -> dict[str, Field]:
    at = np.isin(history.snapshot_frames, checkpoint_frames(case, prepared))
    values = {
        "t": history.t,
        "volume": history.volume,
        "volume_target": history.volume_target,
        "pressure": history.pressure,
        "contact_force": history.contact_force,
        "penetration": history.penetration,
        "inside": history.inside.astype(np.int64),
        "held_force": history.held_force,
        "iterations": history.iterations,
        "frame_steps": history.steps,
        "min_j": history.min_j,
        "kinetic": history.kinetic,
        "elastic": history.elastic,
        "work": history.work,
        "snapshot_frame": history.snapshot_frames[at],
        **_shown(prepared, history.snapshots[at]),
    }
    if prepared.opening is not None:
        opening = prepared.opening
        values |= {"cut_faces": opening.faces, "cut_pairs": opening.pairs, "cut_parts": opening.parts}
    if "surface" in case.recorded:
        values |= surface_fields(prepared, history)
    return new_fields(RUN_FIELDS, values)


def _shown(prepared: Prepared, x: np.ndarray) -> dict[str, np.ndarray]:
    """Recorded positions for a body at `x` (K, n, 3) [m]: its nodes, or with virtual nodes the points of its tissue."""
    body, tissue = prepared.body, prepared.tissue
    if tissue is None:
        names = ("rest", "mass", "triangles", "tetrahedra")
        return {"snapshots": x} | {name: getattr(body, name) for name in names}
    mesh = tissue.mesh
    volumes = tetrahedron_volumes(mesh.points, mesh.tetrahedra)
    weight = np.bincount(mesh.tetrahedra.ravel(), np.repeat(volumes / 4, 4))
    return {
        "snapshots": tissue.places(x),
        "rest": mesh.points,
        "mass": weight * body.mass.sum() / volumes.sum(),
        "triangles": mesh.triangles,
        "tetrahedra": mesh.tetrahedra,
    }


def own_files_of(record: Record) -> dict[str, str]:
    """The user's files with which a run was made: path -> SHA-256 of the content at that time."""
    return json_in(record.attributes.get(OWN_FILES) or "{}", f"the list of own files of {record.name}")


def replay(path: Path) -> tuple[Record, Record, str | None]:
    """Runs the case stored in `path` again: (stored, new, first difference or None if all values are equal)."""
    stored = read_record(path)
    if stored.kind != "run":
        raise StudyError(f"{path} holds a {stored.kind}, only a run can be replayed")
    new = record_of(case_from_json(stored.key))
    return stored, new, difference(stored, new)


def difference(stored: Record, new: Record) -> str | None:
    """The first difference of status or fields, as a sentence; None where all are equal, bit for bit."""
    if stored.status != new.status:
        return f"it was {stored.status}, now it is {new.status}: {new.message}"
    odd = set(stored.fields) ^ set(new.fields)
    if odd:
        return f"'{min(odd)}' is {'not stored' if min(odd) in new.fields else 'no longer computed'}"
    for name, field in stored.fields.items():
        if new.fields[name].values.shape != field.values.shape:
            return f"'{name}' has another shape"
        if not np.array_equal(field.values, new.fields[name].values, equal_nan=field.values.dtype.kind == "f"):
            # As signed numbers, since indices are stored unsigned.
            gap = float(np.nanmax(np.abs(field.values - new.fields[name].values.astype(float))))
            return f"'{name}' differs by up to {gap:.3g} {field.unit}"
    return None
