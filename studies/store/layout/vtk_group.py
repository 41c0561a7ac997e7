"""The group VTKHDF of a record, by which ParaView opens the file (docs.vtk.org, "VTKHDF file format", 2.0).

No number of the record is stored twice: the group links to its datasets, or holds views where VTK wants another shape
or type. What it has of its own lies in heads, or is deflated; all of it has checksums of the format.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from studies.store.layout.hdf5 import ID, add_attribute, add_constant, add_dataset, add_group, add_small, add_view, link
from studies.store.schema import LAYOUTS

GROUP, GRID = "VTKHDF", np.bytes_("UnstructuredGrid")
VERSION = (2, 0)
"""Of the format: the first with steps."""
TRIANGLE, TETRAHEDRON = 5, 10
"""Types of cells as VTK numbers them (vtkCellType.h)."""
SEEN = {
    "run": {"Points": "snapshots", "PointData/rest": "rest", "PointData/mass": "mass"},
    "reference": {"Points": "nodes", "PointData/displacement": "displacement"},
}
"""Kind of a record -> name in the group -> field."""
MOVED = {"run": "snapshots", "reference": "displacement"}
"""The field (K, n, 3) that tells the steps."""


def add_vtk_group(file: ID, kind: str, fields: Mapping[str, Any], items: Mapping[str, ID]) -> None:
    """Adds the group to the file of a record. fields: name -> anything with `values`; items: their datasets.

    The steps of a run are the checkpoints that it reached; one that reached none is seen at rest. A reference is at
    rest in all steps, with its displacement beside. Other kinds, and records without fields, get no group.
    """
    if kind not in SEEN or not fields:
        return
    steps, nodes, _ = fields[MOVED[kind]].values.shape
    seen = SEEN[kind] | {f"FieldData/{name}": name for name in _histories(kind, fields)}
    if not steps:
        seen["Points"] = "rest"
    root = add_group(file, GROUP)
    add_attribute(root, "Version", np.array(VERSION, np.int64))
    add_attribute(root, "Type", GRID)  # of a fixed length, which readers insist on
    add_small(root, "NumberOfPoints", np.array([nodes]))
    _add_cells(root, items["tetrahedra" if fields["tetrahedra"].values.size else "triangles"])
    for name in ("PointData", "FieldData"):
        add_group(root, name)
    for name, field in seen.items():
        shape = fields[field].values.shape
        if field == MOVED[kind]:
            add_view(root, name, items[field], (steps * nodes, 3))
        elif len(shape) == 3:
            add_view(root, name, items[field], (shape[0], shape[1] * shape[2]))
        else:
            link(items[field], root, name)
    if steps:
        moving = next(name for name in seen if seen[name] == MOVED[kind])
        _add_steps(root, _times(fields), {name: nodes * (name == moving) for name in seen}, len(fields["t"].values))


def _histories(kind: str, fields: Mapping[str, Any]) -> list[str]:
    """Fields with a row for each frame of a run or checkpoint of a reference, and none per node."""
    letters = {name: spec.shape.split() for name, spec in LAYOUTS[kind][0].items()}
    found = [name for name in fields if letters[name][0] == letters["t"][0] and "n" not in letters[name]]
    return [name for name in found if fields[name].values.size]


def _times(fields: Mapping[str, Any]) -> np.ndarray:
    """Of the steps [s]."""
    t = fields["t"].values
    return np.append(0.0, t)[fields["snapshot_frame"].values] if "snapshot_frame" in fields else t


def _add_cells(root: ID, cells: ID) -> None:
    """Of one kind. Readers insist that Connectivity and Offsets have one type."""
    count, corners = cells.shape
    add_small(root, "NumberOfCells", np.array([count]))
    add_small(root, "NumberOfConnectivityIds", np.array([count * corners]))
    add_view(root, "Connectivity", cells, (count * corners,), np.int64)
    add_dataset(root, "Offsets", corners * np.arange(count + 1), deflate=True)
    add_constant(root, "Types", (count,), np.uint8(TETRAHEDRON if corners == 4 else TRIANGLE))


def _add_steps(root: ID, times: np.ndarray, moves: Mapping[str, int], rows: int) -> None:
    """One part of the same cells in every step. moves: by how many rows an array goes on from step to step; those of
    FieldData have `rows` and stand there whole."""
    steps, count = add_group(root, "Steps"), len(times)
    add_attribute(steps, "NSteps", np.int64(count))
    add_small(steps, "Values", times)
    add_constant(steps, "NumberOfParts", (count,), np.int64(1))
    none = add_constant(steps, "PartOffsets", (count,), np.int64(0))
    link(add_constant(steps, "CellOffsets", (count, 1), np.int64(0)), steps, "ConnectivityIdOffsets")
    for name in ("PointDataOffsets", "FieldDataOffsets", "FieldDataSizes"):
        add_group(steps, name)
    sizes = add_small(steps, None, np.tile([-1, rows], (count, 1)))  # columns as the array has
    for name, by in moves.items():
        offsets = "PointOffsets" if name == "Points" else name.replace("/", "Offsets/")
        if by:
            add_small(steps, offsets, by * np.arange(count))
        else:
            link(none, steps, offsets)
        if name.startswith("FieldData/"):
            link(sizes, steps, name.replace("/", "Sizes/"))
