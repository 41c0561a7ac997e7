"""The group VTKHDF of a record, by which ParaView opens the file (docs.vtk.org, "VTKHDF file format", 2.0).

No number of the record is stored twice: the group links to its datasets, or holds views where VTK wants another shape
or type.
"""

from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

from studies.store.opening import VIEWS
from studies.store.schema import LAYOUTS

GRID = np.bytes_("UnstructuredGrid")
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


def add_vtk_group(file: h5py.File, kind: str, fields: Mapping[str, h5py.Dataset]) -> None:
    """Adds the group to the file of a record with the datasets `fields`.

    The steps of a run are the checkpoints that it reached; one that reached none is seen at rest. A reference is at
    rest in all steps, with its displacement next to it. Other kinds, and records without fields, get no group.
    """
    if kind not in SEEN or not fields:
        return
    steps, nodes, _ = fields[MOVED[kind]].shape
    seen = SEEN[kind] | {f"FieldData/{name}": name for name in _histories(fields, kind)}
    if not steps:
        seen["Points"] = "rest"
    root = file.create_group(VIEWS)
    root.attrs["Version"] = np.array(VERSION, np.int64)
    root.attrs["Type"] = GRID  # of a fixed length, which readers insist on
    root["NumberOfPoints"] = np.array([nodes])
    _add_cells(root, fields["tetrahedra" if fields["tetrahedra"].size else "triangles"])
    for name in ("PointData", "FieldData"):
        root.create_group(name)
    for name, field in seen.items():
        shape = fields[field].shape
        if field == MOVED[kind]:
            _add_view(root, name, fields[field], (steps * nodes, 3))
        elif len(shape) == 3:
            _add_view(root, name, fields[field], (shape[0], shape[1] * shape[2]))
        else:
            root[name] = fields[field]
    if steps:
        moving = next(name for name in seen if seen[name] == MOVED[kind])
        _add_steps(root, _times(fields), {name: nodes * (name == moving) for name in seen}, len(fields["t"]))


def _histories(fields: Mapping[str, h5py.Dataset], kind: str) -> list[str]:
    """Fields with a row for each frame of a run or checkpoint of a reference, and none per node."""
    letters = {name: spec.shape.split() for name, spec in LAYOUTS[kind][0].items() if name in fields}
    rows = [name for name in letters if letters[name][0] == letters["t"][0] and "n" not in letters[name]]
    return [name for name in rows if fields[name].size]


def _times(fields: Mapping[str, h5py.Dataset]) -> np.ndarray:
    """Of the steps [s]."""
    t = fields["t"][()]
    return np.append(0.0, t)[fields["snapshot_frame"][()]] if "snapshot_frame" in fields else t


def _add_view(place: h5py.Group, name: str, seen: h5py.Dataset, shape: tuple[int, ...], dtype: Any = None) -> None:
    """A virtual dataset of the numbers of `seen` in their order, in another shape and, if given, of another type."""
    layout = h5py.VirtualLayout(shape, dtype or seen.dtype)
    layout.dcpl.set_obj_track_times(False)  # the same content is the same bytes
    layout[...] = h5py.VirtualSource(".", seen.name, seen.shape)
    place.create_virtual_dataset(name, layout)


def _add_cells(root: h5py.Group, cells: h5py.Dataset) -> None:
    """Of one kind. Readers insist that Connectivity and Offsets have one type."""
    count, corners = cells.shape
    root["NumberOfCells"] = np.array([count])
    root["NumberOfConnectivityIds"] = np.array([count * corners])
    _add_view(root, "Connectivity", cells, (count * corners,), np.int64)
    offsets = corners * np.arange(count + 1)
    root.create_dataset("Offsets", data=offsets, chunks=offsets.shape, shuffle=True, compression=1)
    root.create_dataset("Types", (count,), np.uint8, fillvalue=TETRAHEDRON if corners == 4 else TRIANGLE)


def _add_steps(root: h5py.Group, times: np.ndarray, moves: Mapping[str, int], rows: int) -> None:
    """One part of the same cells in every step. moves: by how many rows an array goes on from step to step; those of
    FieldData have `rows` and stand there whole."""
    steps, count = root.create_group("Steps"), len(times)
    steps.attrs["NSteps"] = np.int64(count)
    steps["Values"] = times
    steps.create_dataset("NumberOfParts", (count,), np.int64, fillvalue=1)
    steps["PartOffsets"] = none = steps.create_dataset(None, (count,), np.int64)
    steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = steps.create_dataset(None, (count, 1), np.int64)
    for name in ("PointDataOffsets", "FieldDataOffsets", "FieldDataSizes"):
        steps.create_group(name)
    sizes = steps.create_dataset(None, data=np.tile([-1, rows], (count, 1)))  # columns as the array has
    for name, by in moves.items():
        offsets = "PointOffsets" if name == "Points" else name.replace("/", "Offsets/")
        steps[offsets] = by * np.arange(count) if by else none
        if name.startswith("FieldData/"):
            steps[name.replace("/", "Sizes/")] = sizes
