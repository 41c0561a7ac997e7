"""Reads the content of a mesh file of any supported format, or raises an error with the reason.

Adding a format: its readers in `READERS`, how it counts its cells in studies.geometry.files.promises, and its name in
`FORMATS` (studies.geometry.files.faults).
"""

import contextlib
import io
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path

import meshio

from studies.base.errors import StudyError
from studies.geometry.files.abaqus import read_abaqus
from studies.geometry.files.content import Content, check_content, chosen, content_of
from studies.geometry.files.faults import check_promises, reason_of, unreadable
from studies.geometry.files.gmsh_reader import read_by_gmsh
from studies.geometry.files.masks import is_mask, read_mask
from studies.geometry.files.objects import read_objects, read_ply
from studies.geometry.files.promises import cleaned, fluent_cells, promised_cells
from studies.geometry.files.units import Source
from studies.geometry.files.vtk_files import is_legacy_polydata, read_legacy, read_xml


def read_by_meshio(path: Path) -> meshio.Mesh:
    """The mesh of a file. Raises any exception of meshio for a broken one, and ReadError for one of ANSYS Fluent that
    is not read whole."""
    kind = {".msh": "gmsh", ".fem": "nastran", ".bdf": "nastran", ".nas": "nastran"}.get(path.suffix)
    if path.suffix == ".msh" and path.read_bytes().lstrip().startswith(b"("):
        try:
            mesh, stated = meshio.read(path, file_format="ansys"), fluent_cells(path.read_bytes())
            if sum(len(block) for block in mesh.cells) == stated:
                return mesh
        except (Exception, SystemExit):
            pass  # said below
        raise meshio.ReadError("a mesh of ANSYS Fluent that meshio cannot read whole: save it as VTU")
    return meshio.read(path, file_format=kind)


def read_vtk(path: Path) -> meshio.Mesh:
    return read_legacy(path) if is_legacy_polydata(path) else meshio.read(path)


BOTH = (read_by_meshio, read_by_gmsh)
READERS: dict[str, tuple[Callable[[Path], meshio.Mesh | Content], ...]] = {
    ".stl": (read_objects,),
    ".ply": (read_by_meshio, read_ply),
    ".off": (read_objects,),
    ".obj": (read_objects,),
    ".glb": (read_objects,),
    ".gltf": (read_objects,),
    ".vtk": (read_vtk,),
    ".vtu": (read_xml,),
    ".vtp": (read_xml,),
    ".msh": BOTH,
    ".mesh": BOTH,
    ".bdf": BOTH,
    ".fem": (read_by_meshio,),
    ".nas": BOTH,
    ".inp": (read_abaqus,),
    ".su2": (read_by_meshio,),
    ".vol": (read_by_meshio,),
}
"""Ending -> readers, which are tried in turn until one reads as many cells as the file states."""
ENDINGS = (*READERS, ".nii", ".nii.gz", ".nrrd")
"""Of the files of a folder that are taken for bodies."""


def opened(source: Source) -> Content:
    """The content of a file, or of the part of it that `source` names, in the unit of the file.

    Warns of an assumed unit, of curved cells, and of a label that the image cuts off. Raises StudyError for a file that
    cannot be read whole, or that lacks cells or the part.
    """
    path = source.path
    if not path.is_file():
        raise StudyError(f"there is no mesh file {path}; check the name")
    output = io.StringIO()
    try:
        check_promises(path)
        if not is_mask(path) and path.suffix.lower() not in READERS:
            raise unreadable(path, "no reader knows its ending")
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            content, remark = read_mask(path, source.part) if is_mask(path) else read_whole(path)
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


def read_whole(path: Path) -> tuple[Content, str | None]:
    """All cells of a mesh file, and a remark for the user or None. Raises any exception of the first reader if none of
    READERS can read it, and ReadError if that reads fewer cells than the file states."""
    suffix = path.suffix.lower()
    data = path.read_bytes()
    promised = promised_cells(data, suffix)
    failures: list[BaseException] = []
    with tempfile.TemporaryDirectory() as folder:
        # A copy: gmsh would also run commands in a file of options next to it. glTF refers to files in its folder.
        copy = path if suffix == ".gltf" else Path(folder, "mesh" + suffix)
        if suffix != ".gltf":
            copy.write_bytes(cleaned(data, suffix))
        for reader in READERS[suffix]:
            try:
                read = reader(copy)
                found = len(read.triangles) if isinstance(read, Content) else sum(len(block) for block in read.cells)
                if found < promised:
                    raise meshio.ReadError(f"it states {promised:,} cells, and {found:,} can be read")
                return (read, None) if isinstance(read, Content) else content_of(read, path.name)
            except (Exception, SystemExit) as error:
                failures.append(error)
    raise failures[0]
