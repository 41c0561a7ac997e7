"""Unstructured grids as VTU: written for other programs, and read from them without reordering nodes."""

import contextlib
import io
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.geometry.files.writing import content

SUFFIX = ".vtu"


def write_grid_file(path: Path, points: np.ndarray, cells: dict[str, np.ndarray], data: dict[str, np.ndarray]) -> None:
    """Writes a grid to a file, whole or not at all. Raises StudyError if it cannot be written.

    points: (n, 3) [m]; cells: type as meshio names it ("triangle", "tetra", "tetra10") -> nodes (k, m); data: name ->
    point data.
    """
    blocks: list[Any] = [(kind, nodes.astype(np.int32)) for kind, nodes in cells.items()]
    write_whole(path, content(meshio.Mesh(points, blocks, dict(data)), path.suffix.lower()))


def read_points(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Points (n, 3) and point data of a grid, in the order of the file. Raises StudyError if it cannot be read."""
    if not path.is_file():
        raise StudyError(f"there is no file {path}")
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            grid = meshio.read(path)
    except (Exception, SystemExit) as error:  # the readers of meshio may raise any exception
        raise StudyError(f"{path.name} cannot be read as a grid ({str(error).splitlines()[:1]})") from error
    points = np.asarray(grid.points, dtype=np.float64)
    return points, {name: np.asarray(values) for name, values in grid.point_data.items()}
