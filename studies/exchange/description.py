"""A scene as scene.json: all that another program needs, in SI units, as numbers and in words."""

from collections.abc import Sequence
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from massspring import Obstacle, Plane, Trajectory
from studies.exchange import words
from studies.exchange.meshes import GivenMesh
from studies.metrics.metric import Metric
from studies.metrics.metrics import METRICS
from studies.scene.quantities import allowed
from studies.scene.scene import Scene

SCHEMA, VERSION = "organbench-scene", 1
"""VERSION increases when a reader of the old format would misread the new one."""
OURS = (
    *("alternation", "step_time", "frame_time", "frame_time_p99", "frame_cpu", "real_time_cpu"),
    *("cut_energy", "cut_momentum", "cut_limit", "cut_ms", "heaviness", "unbalanced"),
)
"""Metrics that only apply inside this program."""
OF_CUTS = ("overlap", "piece_worst", "piece_sum_worst")
"""Metrics of organs that are cut."""
HELD, OUTER, LUMEN = "held_", "outer", "lumen"
"""Point data of the meshes: 1 at the nodes of a held region, of the outer surface, of the lumen's, else 0."""
FILES = {"straight": "straight.vtu", "curved": "curved.vtu", "surface": "surface.vtu", "paths": "paths.csv"}
CUT_FILES = {"straight": "cut_straight.csv", "curved": "cut_curved.csv"}
BETTER = {"lower": "lower is better", "higher": "higher is better", "-": "nearer to 0 is better"}


def judged_metrics(scene: Scene) -> list[Metric]:
    """The metrics for an entry in this scene."""
    left_out = OURS if scene.cut is not None else (*OURS, *OF_CUTS)
    metrics = [metric for metric in METRICS if metric.name not in left_out]
    return [m for m in metrics if m.quantity is None or allowed(scene, m.quantity)]


def description(scene: Scene, meshes: Sequence[GivenMesh], why_not_curved: str) -> dict[str, Any]:
    """The content of scene.json, JSON-able."""
    tissue, lumen, start = scene.tissue, scene.lumen, scene.start
    moves = scene.reference is not None and scene.reference.dt is not None
    return {
        "schema": SCHEMA,
        "version": VERSION,
        "name": scene.name,
        "title": scene.title,
        "units": {"length": "m", "time": "s", "mass": "kg", "force": "N", "pressure": "Pa"},
        "meshes": {mesh.kind: mesh_entry(mesh) for mesh in meshes},
        "why_no_curved_mesh": why_not_curved,
        "material": {
            "shear_modulus": tissue.shear_modulus,
            "bulk_modulus": tissue.shear_modulus * tissue.bulk_over_shear,
            "density": tissue.density,
            "words": words.MATERIAL,
            "source": tissue.source,
        },
        "gravity": list(scene.gravity),
        "damping": {"rate": scene.damping, "words": words.DAMPING_OF_MOTION if moves else words.DAMPING},
        "start": {"words": words.start_words(scene), "speed": start and start.speed},
        "duration": scene.duration,
        "frames": scene.frames,
        "checkpoints": list(scene.checkpoints),
        "held": [
            {"name": held.name, "point_data": HELD + held.name, "path": path_entry(held.path)} for held in scene.held
        ],
        "obstacles": [obstacle_entry(obstacle) for obstacle in scene.obstacles],
        "paths": {"file": FILES["paths"], "words": words.PATHS},
        "lumen": lumen
        and {
            "content": lumen.content,
            "volume": {"times": list(lumen.filling.times), "factors": list(lumen.filling.values)},
            "words": words.lumen_words(lumen),
        },
        "cut": cut_entry(scene),
        "force": {
            "of": scene.probed.what,
            "number": scene.probed.number,
            "direction": list(scene.probed.direction),
            "words": words.force_words(scene),
        },
        "judged": [
            {"name": one.name, "unit": one.unit, "definition": one.description, "better": BETTER[one.better]}
            for one in judged_metrics(scene)
        ],
    }


def mesh_entry(mesh: GivenMesh) -> dict[str, Any]:
    """A mesh: its file and its sizes."""
    return {
        "file": FILES[mesh.kind],
        "cells": "quadratic tetrahedra, VTK's order" if mesh.cells.shape[1] == 10 else "tetrahedra",
        "nodes": len(mesh.points),
        "outer_nodes": mesh.outer_count,
        "tetrahedra": len(mesh.cells),
        "sha256": mesh.digest,
        "volumes": dict(zip(mesh.volumes.names, mesh.volumes.measure(mesh.points).tolist(), strict=True)),
    }


def path_entry(path: Trajectory) -> dict[str, Any]:
    """Key times and displacements, and the same in words."""
    ways = np.array(path.displacements).tolist()
    return {"times": list(path.times), "displacements": ways, "words": words.moved(path)}


def obstacle_entry(obstacle: Obstacle) -> dict[str, Any]:
    """An obstacle as numbers by kind, and in words."""
    shape = {one.name: getattr(obstacle, one.name) for one in fields(obstacle)}
    entry = {"kind": type(obstacle).__name__.lower(), "friction": shape.pop("friction", 0.0)}
    entry |= {name: list(value) if isinstance(value, tuple) else value for name, value in shape.items()}
    if isinstance(obstacle, Plane):
        entry["normal"] = obstacle.unit_normal.tolist()
    entry["path"] = path_entry(obstacle.path)
    return entry | {"friction_words": words.friction_words(obstacle), "words": words.obstacle_words(obstacle)}


def cut_entry(scene: Scene) -> dict[str, Any] | None:
    """Where the meshes are cut; None where they are not."""
    cut = scene.cut
    if cut is None:
        return None
    blade = cut.within and {"kind": type(cut.within).__name__.lower()} | asdict(cut.within)
    plane = {"point": list(cut.plane.point), "normal": list(cut.plane.normal)}
    numbers = {"name": cut.name, "plane": plane, "within": blade, "contact": cut.contact}
    return numbers | {"files": CUT_FILES, "words": words.cut_words(cut)}
