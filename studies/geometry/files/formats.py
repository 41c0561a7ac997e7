"""Reads the content of a mesh file of any supported format, or raises an error with the reason.

Adding a format: its ending in `ENDINGS`, its reader in `read`, its name in `FORMATS` (studies.geometry.files.faults).
"""

import contextlib
import io
import tempfile
import warnings
from pathlib import Path

import meshio
import numpy as np

from studies.base.errors import StudyError
from studies.geometry.files.content import Content, check_content, chosen, fans
from studies.geometry.files.faults import check_promises, reason_of, unreadable
from studies.geometry.files.masks import is_mask, read_mask
from studies.geometry.files.objects import read_objects
from studies.geometry.files.units import Source
from studies.geometry.files.vtk_files import as_grid, is_legacy_polydata, read_legacy, with_arrays

OBJECTS = (".off", ".obj", ".glb", ".gltf")
ENDINGS = (*(".stl", ".ply", ".vtk", ".vtp", ".vtu", ".msh", ".nii", ".nii.gz", ".nrrd"), *OBJECTS)
"""Of the files of a folder that are taken for surfaces; a file that is named may have another one of meshio's."""


def opened(source: Source) -> Content:
    """The content of a file, or of the part of it that `source` names, in the unit of the file.

    meshio reads STL, PLY, VTK, VTU, MSH and more, trimesh OFF, OBJ and glTF. Warns of an assumed unit and of a label
    that the image cuts off. Raises StudyError for a file that cannot be read, or that lacks cells or the part.
    """
    path = source.path
    if not path.is_file():
        raise StudyError(f"there is no mesh file {path}; check the name")
    output = io.StringIO()
    try:
        check_promises(path)
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            content, remark = read(path, source.part)
    except StudyError:
        raise
    # Readers may raise any exception for a broken file, and meshio may even exit the process.
    except (Exception, SystemExit) as error:
        raise unreadable(path, reason_of(path, error, output.getvalue())) from error
    if remark:
        warnings.warn(f"{path.name}: {remark}", stacklevel=3)
    if content.unit_by_custom and source.unit is None and source.longest_side is None:
        warnings.warn(
            f"{path.name}: its header does not say the unit; assuming millimetres (the convention); "
            "--unit sets another",
            stacklevel=3,
        )
    content = check_content(content, path.name)
    return content if is_mask(path) else chosen(content, source.part, path.name)


def read(path: Path, part: str | None) -> tuple[Content, str | None]:
    """The content of a file, and a remark for the user or None. Raises any exception of the reader."""
    suffix = path.suffix.lower()
    if is_mask(path):
        return read_mask(path, part)
    if suffix in OBJECTS:
        return read_objects(path), None
    if suffix == ".vtk" and is_legacy_polydata(path):
        points, triangles = read_legacy(path)
        return Content(points, triangles, np.empty((0, 4), np.int64)), None
    if suffix in (".vtp", ".vtu"):
        data = path.read_bytes()
        with tempfile.TemporaryDirectory() as folder:
            grid = Path(folder, "surface.vtu")
            grid.write_bytes(as_grid(data) if suffix == ".vtp" else with_arrays(data))
            return content_of(meshio.read(grid), path.name), None
    return content_of(meshio.read(path), path.name), None


def content_of(raw: meshio.Mesh, name: str) -> Content:
    """Tetrahedra and triangles of a mesh, with polygons cut into triangles; points and lines are left out. Raises
    StudyError for cells of other kinds."""
    tetrahedra, triangles = [np.empty((0, 4), np.int64)], [np.empty((0, 3), np.int64)]
    for block in raw.cells:
        if block.type in ("vertex", "line"):
            continue
        data = np.asarray(block.data).astype(np.int64)
        if block.type == "tetra":
            tetrahedra.append(data)
        elif block.type in ("triangle", "quad", "polygon"):
            triangles.append(fans(data))
        else:
            raise StudyError(
                f"{name}: cells of kind {block.type!r} are not supported; convert to triangles or tetrahedra"
            )
    data = {key: np.asarray(values) for key, values in raw.point_data.items()}
    return Content(np.asarray(raw.points, float), np.vstack(triangles), np.vstack(tetrahedra), data)
