"""Records of a cube to view: runs, and a reference that knows the displacement as a formula."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from skfem import MeshTet

from massspring import ImplicitVolume, Method
from reference_fem import nodes
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.sample import Sample, SamplePoints, sample_fields
from studies.runs.case import Case
from studies.runs.recipes import TetrahedralBody
from studies.scene.scene import Scene
from studies.store.paths import record_path
from studies.store.record import Record, Status, new_fields, new_record, write_record
from studies.store.schema import REFERENCE_FIELDS
from tests.studies.made_up_run import CELLS, POINTS, SCENE, bend, run


def stored_case(root: Path, study="made", scene: Scene = SCENE, method: Method | None = None, **changes) -> Path:
    """The file of a run in a scene, as made_up_run.run makes it with `changes`."""
    case = Case(scene, TetrahedralBody(nodes=150), method or ImplicitVolume())
    path = record_path(root, study, case.name, case.key)
    write_record(path, replace(run(scene=scene, **changes).record, key=case.key, name=case.name))
    return path


def reference_record(scene: Scene, status: Status = Status.OK) -> Record:
    """The finest reference of a scene on the cube: at checkpoint k (of K) it is bent by (k + 1) / K."""
    solve = ReferenceSolve(scene)
    mesh = MeshTet(np.ascontiguousarray(POINTS.T), np.ascontiguousarray(CELLS.T))
    x, steps = nodes(mesh), len(scene.checkpoints)
    lengths = {"K": steps, "o": len(scene.obstacles), "g": len(scene.held), "n": len(x), "c": len(CELLS), "3": 3}
    values = {
        name: np.zeros([lengths[part] for part in spec.shape.split()])
        for name, spec in REFERENCE_FIELDS.items()
        if name != "tetrahedra" and not name.startswith("sample_")
    }
    share = np.arange(1, steps + 1) / steps
    values |= {"t": np.array(scene.checkpoints), "nodes": x, "tetrahedra": np.ascontiguousarray(mesh.t.T)}
    values |= {"displacement": share[:, None, None] * bend(x), "volume": 1 + 0.1 * share}
    series = np.zeros(steps)
    whole = Sample("", 1, 1.0, bend(POINTS), series, 1 + 0.1 * share, series, series)
    values |= sample_fields(SamplePoints(POINTS, CELLS), [whole], len(whole.force))
    return new_record(
        kind="reference",
        key=solve.key,
        name=solve.name,
        status=status,
        message="",
        fingerprint="",
        attributes={
            "scene": scene.name, "unknowns": 1, "steps_done": steps, "off_shape": 0, "stopped": "", "seconds": 1.0,
        },
        fields=new_fields(REFERENCE_FIELDS, values),
    )  # fmt: skip


def stored_reference(root: Path, scene: Scene = SCENE, status: Status = Status.OK) -> Path:
    """The file of that reference."""
    record = reference_record(scene, status)
    path = record_path(root, "reference", record.name, record.key)
    write_record(path, record)
    return path
