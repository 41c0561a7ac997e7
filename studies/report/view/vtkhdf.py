"""A moving grid as a VTKHDF file, which ParaView opens (docs.vtk.org, "VTKHDF file format", 2.0).

Readers insist that attributes of text have a fixed length, that Offsets and Connectivity have one type, and that
fields of text are ASCII.
"""

import io
from pathlib import Path

import h5py
import numpy as np

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.report.view.side_by_side import Data, Grid
from studies.store.opening import VIEWS
from studies.store.vtk_group import GRID, VERSION

SUFFIX = ".vtkhdf"
"""The one that ParaView knows."""


def check_target(path: Path) -> None:
    """Raise StudyError unless `path` can be written as a file that ParaView knows."""
    if path.suffix.lower() != SUFFIX:
        raise StudyError(f"{path.name}: ParaView knows the format by its suffix; choose a name that ends in {SUFFIX}")
    if path.is_dir():
        raise StudyError(f"{path} is a folder; give the name of a file")


def write_grid(path: Path, grid: Grid) -> int:
    """Writes `grid` to `path`, whole or not at all, and returns how many bytes. Raises StudyError when it cannot."""
    check_target(path)
    image = io.BytesIO()
    with h5py.File(image, "w") as file:
        root = file.create_group(VIEWS)
        root.attrs["Version"] = np.array(VERSION, np.int64)
        root.attrs["Type"] = GRID
        _geometry(root, grid)
        steps = _steps(root, grid)
        for group, data in (
            ("PointData", grid.point_data),
            ("CellData", grid.cell_data),
            ("FieldData", grid.field_data),
        ):
            for name, item in data.items():
                _array(root, group, name, item)
                steps[f"{group}Offsets/{name}"] = _rows(grid, item.rows if item.moves else 0)
        for name, item in grid.field_data.items():
            steps[f"FieldDataSizes/{name}"] = np.tile(np.array([item.columns, item.rows]), (len(grid.times), 1))
    content = image.getvalue()
    write_whole(path, content)
    return len(content)


def _geometry(root: h5py.Group, grid: Grid) -> None:
    steps, points, _ = grid.points.shape
    root["NumberOfPoints"] = np.array([points], np.int64)
    root["NumberOfCells"] = np.array([len(grid.types)], np.int64)
    root["NumberOfConnectivityIds"] = np.array([len(grid.connectivity)], np.int64)
    root["Points"] = grid.points.reshape(steps * points, 3)
    root["Connectivity"] = grid.connectivity.astype(np.int64)
    root["Offsets"] = grid.offsets.astype(np.int64)
    root["Types"] = grid.types.astype(np.uint8)


def _steps(root: h5py.Group, grid: Grid) -> h5py.Group:
    """One part of the same cells in every step, whose points follow one another."""
    count, points, _ = grid.points.shape
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(count)
    steps["Values"] = grid.times.astype(np.float64)
    steps["PartOffsets"] = _rows(grid, 0)
    steps["NumberOfParts"] = np.ones(count, np.int64)
    steps["PointOffsets"] = _rows(grid, points)
    steps["CellOffsets"] = _rows(grid, 0)[:, None]
    steps["ConnectivityIdOffsets"] = _rows(grid, 0)[:, None]
    return steps


def _rows(grid: Grid, rows: int) -> np.ndarray:
    """Where each step begins in an array with so many rows for a step, (K,); 0 for one that stands still."""
    return rows * np.arange(len(grid.times), dtype=np.int64)


def _array(root: h5py.Group, group: str, name: str, item: Data) -> None:
    values = item.values.reshape(-1, *item.values.shape[2:]) if item.moves else item.values
    text = h5py.string_dtype("ascii") if values.dtype.kind == "U" else None
    dataset = root.create_dataset(f"{group}/{name}", data=values.astype(object) if text else values, dtype=text)
    dataset.attrs["unit"], dataset.attrs["description"] = item.unit, item.description
