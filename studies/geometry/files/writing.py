"""Writes a mesh or any grid to a file, whole or not at all, and reads the nodes of a grid in the order of the file."""

import contextlib
import io
import tempfile
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.geometry.files.checked_reading import PATCH
from studies.geometry.files.units import UNITS, check_unit
from studies.geometry.mesh.organ_mesh import OrganMesh
from studies.geometry.mesh.second_order import CurvedMesh

VOLUMES, SURFACES = (".vtu", ".vtk", ".msh"), (".stl", ".ply", ".obj", ".off")
"""Suffixes of formats with tetrahedra, and of those with triangles only."""
TAGS = {"outer": 1, "lumen": 2, "tissue": 3}
"""Values of the cell data `part` (VTU, VTK) and of the physical groups (MSH)."""

SUFFIX = ".vtu"
"""Of grids for other programs."""


def check_target(path: Path, source: Path | None = None) -> None:
    """Raise StudyError unless `path` has a suffix that can be written, is no folder, and is not the file `source`."""
    suffixes = (*VOLUMES, *SURFACES)
    if path.suffix.lower() not in suffixes:
        raise StudyError(f"{path.name}: meshes are written as {', '.join(suffixes)}; choose one of these suffixes")
    if path.is_dir():
        raise StudyError(f"{path} is a folder; give the name of a file")
    if source is not None and path.exists() and source.exists() and path.samefile(source):
        raise StudyError(f"{path.name} is the file that is read, and it stays as it is; give another name to -o")


def holds_tetrahedra(path: Path) -> bool:
    return path.suffix.lower() in VOLUMES


def write_mesh(mesh: OrganMesh, path: Path, unit: str = "m", curved: CurvedMesh | None = None) -> None:
    """Writes the mesh, or its second-order form `curved`, to a file; the suffix decides the format.

    unit: of the lengths in the file, one of UNITS. Formats without tetrahedra get the boundary. Raises StudyError for
    an unknown suffix or unit, for a curved mesh in a format without tetrahedra, and if the file cannot be written.
    """
    check_target(path)
    check_unit(unit)
    if curved is not None and not holds_tetrahedra(path):
        raise StudyError(f"{path.name}: {path.suffix} holds flat triangles only; write a curved mesh as .vtu")
    written = cells_of(mesh, curved, holds_tetrahedra(path))
    written.points = written.points / UNITS[unit]
    if path.suffix.lower() in (".stl", ".obj", ".off"):
        written.point_data, written.cell_data = {}, {}
    if path.suffix.lower() == ".ply":
        written.cell_data = {}
    if path.suffix.lower() == ".msh":
        parts = written.cell_data.pop("part")
        written.cell_data = {"gmsh:physical": parts, "gmsh:geometrical": parts}
        # meshio cannot read back integers, nor the text form that it writes: hence floats, and the binary form.
        patches: dict[str, Any] = {name: np.asarray(values, float) for name, values in written.point_data.items()}
        written.point_data = patches
    write_whole(path, content(written, path.suffix.lower()))


def cells_of(mesh: OrganMesh, curved: CurvedMesh | None, tetrahedra: bool) -> meshio.Mesh:
    """The boundary triangles, and tetrahedra if `tetrahedra` is set and there are any, or those of second order alone;
    with parts, and with patches, which contain no mid-side nodes."""
    if curved is not None:
        points, cells = curved.points, {"tetra10": curved.cells}
        parts = [np.full(len(curved.cells), TAGS["tissue"], np.int32)]
    else:
        points, cells = mesh.points[: mesh.surface_count], {"triangle": mesh.triangles}
        outer = (mesh.triangles < mesh.outer_count).all(axis=1)
        parts = [np.where(outer, TAGS["outer"], TAGS["lumen"]).astype(np.int32)]
        if tetrahedra and len(mesh.tetrahedra):
            points, cells["tetra"] = mesh.points, mesh.tetrahedra
            parts.append(np.full(len(mesh.tetrahedra), TAGS["tissue"], np.int32))
    blocks: list[Any] = [(kind, nodes.astype(np.int32)) for kind, nodes in cells.items()]
    data: dict[str, Any] = {}
    for name, nodes in mesh.patches.items():
        data[PATCH + name] = np.zeros(len(points), np.int32)
        data[PATCH + name][nodes] = 1
    marks: dict[str, Any] = {"part": parts}
    return meshio.Mesh(points, blocks, data, marks)


def content(mesh: meshio.Mesh, suffix: str) -> bytes:
    """The bytes of the file, which meshio writes to a temporary folder."""
    options = {".stl": {"binary": True}, ".msh": {"file_format": "gmsh22", "binary": True}}.get(suffix, {})
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        path = Path(folder, "mesh" + suffix)
        meshio.write(path, mesh, **options)
        return path.read_bytes()


def write_grid_file(path: Path, points: np.ndarray, cells: dict[str, np.ndarray], data: dict[str, np.ndarray]) -> None:
    """Writes a grid to a file, whole or not at all. points: (n, 3) [m]; cells: type as meshio names it ("triangle",
    "tetra10") -> nodes (k, m); data: name -> point data. Raises StudyError if it cannot be written."""
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
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        raise StudyError(f"{path.name} cannot be read as a grid; is it whole? ({reason})") from error
    points = np.asarray(grid.points, dtype=np.float64)
    return points, {name: np.asarray(values) for name, values in grid.point_data.items()}
