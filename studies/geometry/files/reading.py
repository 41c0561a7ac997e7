"""Reading a surface or tetrahedral mesh from a file, in metres, welded and checked."""

import contextlib
import hashlib
import io
import warnings
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from studies.base.errors import StudyError
from studies.geometry.files.estimate import check_whole
from studies.geometry.files.units import UNITS, check_unit
from studies.geometry.mesh.checks import check_finite, check_surface, check_tetrahedra
from studies.geometry.mesh.organ_mesh import OrganMesh, signed_volume, surface_first, tetrahedron_volumes

LARGEST, SMALLEST = 5.0, 1e-3
"""Longest side [m] of a bounding box beyond which the unit is probably wrong: no organ is that large or small."""
PATCH = "patch_"
"""Point data with this prefix are attachments."""
WELD = 1e-7
"""Points nearer than this fraction of the diagonal are one point: single precision, in which STL is written."""


def read_mesh(path: str | Path, unit: str | None = None, flip: bool = False) -> OrganMesh:
    """A closed surface or a tetrahedral body from any file that meshio reads (STL, PLY, OBJ, VTK, VTU, MSH, ...).

    unit: of the file's coordinates, "m" (default), "cm" or "mm". flip: turn an inside-out surface or negative
    tetrahedra round instead of refusing them. Duplicate points are welded and points that nothing uses are left out;
    where a body has tetrahedra, triangles stored beside them are left out too. Warns when the size does not
    fit the unit. Raises StudyError for a file that cannot be read or whose mesh is not usable.
    """
    path = Path(path)
    if unit is not None:
        check_unit(unit)
    raw = parse(path)
    name = path.name
    points = np.asarray(raw.points, float) * UNITS[unit or "m"]
    if points.ndim != 2 or points.shape[1] != 3:
        raise StudyError(f"{name}: points have shape {points.shape}; a body needs three coordinates per point")
    check_finite(points, name)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    recipe = {"kind": "file", "name": path.stem, "file": name, "sha256": digest, "unit": unit or "m", "flip": flip}
    tetrahedra, triangles = cells_of(raw, name)
    points, cells = weld(points, tetrahedra if len(tetrahedra) else triangles)
    warn_about_unit(points, name)
    if len(tetrahedra):
        return with_patches(tetrahedral(points, cells, flip, recipe), raw)
    triangles = cells
    if flip and signed_volume(points, triangles) < 0:
        triangles = triangles[:, ::-1].copy()
    check_surface(points, triangles, name)
    none = np.empty((0, 4), np.int64)
    return with_patches(OrganMesh(path.stem, points, triangles, none, len(points), {}, recipe), raw)


def with_patches(mesh: OrganMesh, raw: meshio.Mesh) -> OrganMesh:
    """The mesh with the attachments that the file keeps as point data `patch_NAME`, above 0 at their nodes."""
    _, number = KDTree(np.asarray(raw.points, float) * UNITS[mesh.recipe["unit"]]).query(
        mesh.points[: mesh.outer_count]
    )
    patches = {
        key.removeprefix(PATCH): np.flatnonzero(np.asarray(values).ravel()[number] > 0)
        for key, values in raw.point_data.items()
        if key.startswith(PATCH)
    }
    return replace(mesh, patches=patches) if patches else mesh


def parse(path: Path) -> meshio.Mesh:
    """What meshio makes of the file; raises StudyError when it makes nothing of it."""
    if not path.is_file():
        raise StudyError(f"there is no mesh file {path}; check the name")
    check_whole(path)
    output = io.StringIO()
    try:
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return meshio.read(path)
    # Foreign parsers raise whatever a broken file makes them trip over, and meshio even exits the process.
    except (Exception, SystemExit) as error:
        reason = " ".join((str(error) if isinstance(error, meshio.ReadError) else type(error).__name__).split())
        known = "STL, PLY, OBJ, VTK, VTU or MSH"
        raise StudyError(
            f"{path.name} is not a mesh that can be read ({reason or 'no reason'}); give {known}"
        ) from error


def cells_of(raw: meshio.Mesh, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Tetrahedra (k, 4) and triangles (t, 3), quadrilaterals cut in two; raises StudyError when there are neither."""
    tetrahedra, triangles = [np.empty((0, 4), np.int64)], [np.empty((0, 3), np.int64)]
    for block in raw.cells:
        if block.type in ("vertex", "line"):
            continue
        if block.type not in ("tetra", "triangle", "quad"):
            raise StudyError(
                f"{name}: cells of kind {block.type!r} are not supported; convert to triangles or tetrahedra"
            )
        data = np.asarray(block.data).astype(np.int64)
        if block.type == "tetra":
            tetrahedra.append(data)
        elif block.type == "triangle":
            triangles.append(data)
        else:
            triangles.append(data[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3))
    both = np.vstack(tetrahedra), np.vstack(triangles)
    if not len(both[0]) and not len(both[1]):
        raise StudyError(f"{name}: the file has no triangles and no tetrahedra; export a surface or a volume mesh")
    return both


def warn_about_unit(points: np.ndarray, name: str) -> None:
    """Warn when a body in metres is larger than LARGEST or smaller than SMALLEST."""
    box = np.ptp(points, axis=0) if len(points) else np.zeros(3)
    if box.max() > LARGEST:
        sides = " x ".join(f"{side:.4g}" for side in box)
        warnings.warn(
            f"{name}: the bounding box is {sides} m; if the file is in millimetres, say unit='mm'", stacklevel=3
        )
    elif 0 < box.max() < SMALLEST:
        sides = " x ".join(f"{side:.4g}" for side in box)
        warnings.warn(f"{name}: the bounding box is {sides} m; if the file is in metres, say unit='m'", stacklevel=3)


def weld(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points used by the cells, those within WELD of the diagonal made one, in the file's order; cells renumbered."""
    if cells.min(initial=0) < 0 or cells.max(initial=-1) >= len(points):
        raise StudyError(
            f"a cell uses point {cells.max()}, but the file has only {len(points)} points; export it again"
        )
    reach = WELD * float(np.linalg.norm(np.ptp(points, axis=0)))
    i, j = KDTree(points).query_pairs(reach, output_type="ndarray").T
    graph = coo_array((np.ones(len(i)), (i, j)), shape=(len(points), len(points)))
    _, label = connected_components(graph, directed=False)
    _, first = np.unique(label, return_index=True)
    cells = first[label][cells]
    used, renumbered = np.unique(cells, return_inverse=True)
    return points[used], renumbered.reshape(cells.shape).astype(np.int64)


def tetrahedral(points: np.ndarray, tetrahedra: np.ndarray, flip: bool, recipe: dict) -> OrganMesh:
    """A checked body with its boundary, the boundary's nodes first."""
    if flip:
        negative = tetrahedron_volumes(points, tetrahedra) < 0
        tetrahedra[negative] = tetrahedra[negative][:, [0, 2, 1, 3]]
    check_tetrahedra(points, tetrahedra, recipe["file"])
    points, triangles, tetrahedra, count = surface_first(points, tetrahedra)
    return OrganMesh(recipe["name"], points, triangles, tetrahedra, count, {}, recipe)
