"""A run with exact numbers: four frames of a cube that is shifted and stretched."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from studies.metrics.metrics import METRICS
from studies.metrics.run import Run
from studies.metrics.table import metric
from studies.reference.solution import Boundary
from studies.runs.case import Case
from studies.runs.recipes import TetrahedralBody
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.store.record import Status, new_fields, new_record
from studies.store.schema import RUN_FIELDS
from tests.studies.tiny import cube

EDGE = 0.1


POINTS, TRIANGLES, CELLS = cube(2, EDGE)


T = np.array([1.0, 2.0, 3.0, 4.0])


SCENE = replace(BALL_CLAMPED, checkpoints=(2.0, 4.0), duration=4.0)


SHIFT = np.array([0.03, 0.0, 0.0])


UNCERTAINTIES = ("force", "force_end", "surface", "interior", "silhouette", "volume", "pressure", "lumen", "frequency")
"""Quantities with floors of 1 %, 2 % and so on; the others of METRICS follow."""


ATTRIBUTES = {
    "rest_volume": EDGE**3,
    "dt": 0.05,
    "dt_limit": 0.1,
    "steps": 20,
    "frame": 1.0,
    "frames": 4,
    "good_frames": 4,
    "nodes": len(POINTS),
    "springs": 0,
    "triangles": len(TRIANGLES),
    "law": "uniform",
    "skipped_steps": 0,
    "capped_steps": 0,
    "volumes": 1,
    "lumen_column": -1,
    "unknowns_per_volume": 81.0,
    "alternation": 0.25,
    "sway": 0.04,
    "heaviness": 2.5,
    "unbalanced": 0.06,
    "warnings": "",
}


def bend(x, checkpoint=-1):
    """A displacement that varies: a rigid shift and a tenth of stretch along z, at every checkpoint."""
    return SHIFT + np.column_stack([0 * x[:, 0], 0 * x[:, 1], 0.1 * x[:, 2]])


def quantities() -> list[str]:
    """What metrics compare with a reference."""
    return [metric.quantity for metric in METRICS if metric.quantity is not None]


def reference(motion=bend, force=(1.0, 2.0), pressure=(10.0, 20.0)):
    """What Reference promises, with a displacement that is a formula."""
    return SimpleNamespace(
        source="made up",
        shape_error=float("nan"),
        displacement=motion,
        force=np.array(force),
        boundary=Boundary(POINTS, TRIANGLES, motion(POINTS)),
        surface=lambda: (POINTS + motion(POINTS), TRIANGLES),
        field=lambda name: {"pressure": np.array(pressure), "lumen_pressure": np.array(pressure)}[name],
        total_uncertainty={
            name: 0.01 * (k + 1) for k, name in enumerate(dict.fromkeys((*UNCERTAINTIES, *quantities())))
        },
    )


def run(final=None, volume=(1.0, 1.0, 1.0, 1.0), force=(0.5, 1.0, 1.5, 2.0), **changes) -> Run:
    """A run of four frames on a cube that ends at `final` [m]; the force is felt by the upper cap, against z."""
    final = POINTS + bend(POINTS) if final is None else final
    held = np.zeros((4, 2, 3))
    held[:, 1, 2] = -np.array(force)
    values = {
        "t": T,
        "volume": EDGE**3 * np.array(volume)[:, None],
        "volume_target": np.full((len(volume), 1), EDGE**3),
        "pressure": np.full((4, 1), 5.0),
        "contact_force": np.zeros((4, 1, 3)),
        "held_force": held,
        "penetration": np.zeros((4, 1)),
        "iterations": np.zeros((4, 2), dtype=int),
        "min_j": np.array([1.0, 0.8, 0.6, 0.7]),
        "snapshot_frame": np.array([2, 4]),
        "snapshots": np.stack([POINTS, final]),
        "rest": POINTS,
        "mass": np.full(len(POINTS), 1.0),
        "triangles": TRIANGLES,
        "tetrahedra": CELLS,
    } | changes.pop("values", {})
    record = new_record(
        kind="run",
        key="{}",
        name="made up",
        status=changes.pop("status", Status.OK),
        message="",
        fingerprint="",
        attributes=ATTRIBUTES | changes.pop("attributes", {}),
        fields=new_fields(RUN_FIELDS, values),
    )
    case = Case(changes.pop("scene", SCENE), TetrahedralBody())
    return Run(case, record, changes.pop("reference", reference()), changes.pop("timing", None))


def of(name: str, **changes) -> float:
    return metric(name)(run(**changes))
