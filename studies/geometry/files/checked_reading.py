"""Reads a surface or tetrahedral mesh from a file in metres, welds and checks it."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from studies.geometry.files.content import Content, coincident
from studies.geometry.files.opening import opened
from studies.geometry.files.units import LARGEST, SMALLEST, Source, as_source, check_range
from studies.geometry.mesh.checks import check_finite, check_surface, check_tetrahedra
from studies.geometry.mesh.organ_mesh import OrganMesh, compact, signed_volume, surface_first, turn_inverted

PATCH = "patch_"
"""Prefix of point data that are attachments."""


def read_mesh(path: str | Path | Source, unit: str | None = None, flip: bool = False) -> OrganMesh:
    """A closed surface or a tetrahedral body from any file that `opened` reads (STL, PLY, OBJ, VTK, glTF, masks, ...).

    path: a file, or a Source. unit: of the coordinates, one of UNITS; None: the one that the file states, or metres.
    flip: whether an inverted surface or inverted tetrahedra are flipped instead of refused. Coincident points are
    merged, unused ones left out, and of a body with tetrahedra its triangles too. Warns if the size does not fit the
    unit. Raises StudyError for a file that cannot be read or whose mesh is not usable.
    """
    source = as_source(path, unit)
    name = source.path.name
    content = opened(source)
    check_finite(content.points, name)
    side = content.longest_side
    file_unit = source.unit or content.unit or "m"
    metres = source.metres(side, file_unit)
    check_range(metres * side, name)
    recipe = {"kind": "file", "name": source.path.stem, "file": name, "sha256": source.sha256, "unit": file_unit}
    recipe |= {"flip": flip} | source.recipe
    points, cells = weld(content.points * metres, content.cells)
    warn_about_unit(points, name)
    if len(content.tetrahedra):
        return with_patches(tetrahedral(points, cells, flip, recipe), content, metres)
    triangles = cells
    if flip and signed_volume(points, triangles) < 0:
        triangles = triangles[:, ::-1].copy()
    check_surface(points, triangles, name)
    none = np.empty((0, 4), np.int64)
    return with_patches(OrganMesh(source.path.stem, points, triangles, none, len(points), {}, recipe), content, metres)


def with_patches(mesh: OrganMesh, content: Content, metres: float) -> OrganMesh:
    """The mesh with the attachments of the file: point data `patch_NAME` above 0 at its outer nodes; metres: per unit
    of the file."""
    marked = marked_nodes(content)
    if not marked:
        return mesh
    _, number = KDTree(content.points * metres).query(mesh.points[: mesh.outer_count])
    return replace(mesh, patches={name: np.flatnonzero(inside[number]) for name, inside in marked.items()})


def marked_nodes(content: Content) -> dict[str, np.ndarray]:
    """Name of each attachment -> which points of the file belong to it, shape (n,) bool."""
    data = {key.removeprefix(PATCH): values for key, values in content.point_data.items() if key.startswith(PATCH)}
    return {name: np.asarray(values).ravel() > 0 for name, values in data.items()}


def warn_about_unit(points: np.ndarray, name: str) -> None:
    box = np.ptp(points, axis=0) if len(points) else np.zeros(3)
    sides = " x ".join(f"{side:.4g}" for side in box)
    if box.max() > LARGEST or 0 < box.max() < SMALLEST:
        unit = "millimetres, say unit='mm'" if box.max() > LARGEST else "metres, say unit='m'"
        warnings.warn(f"{name}: the bounding box is {sides} m; if the file is in {unit}", stacklevel=3)


def weld(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) that the cells use, with coincident ones merged, in the order of the file; and renumbered cells."""
    return compact(points, coincident(points)[cells])


def tetrahedral(points: np.ndarray, tetrahedra: np.ndarray, flip: bool, recipe: dict) -> OrganMesh:
    """A checked body with its boundary, whose nodes come first; flip: whether inverted tetrahedra are flipped. Raises
    StudyError for tetrahedra that form no usable body."""
    if flip:
        tetrahedra = turn_inverted(points, tetrahedra)
    check_tetrahedra(points, tetrahedra, recipe["file"])
    points, triangles, tetrahedra, count = surface_first(points, tetrahedra)
    return OrganMesh(recipe["name"], points, triangles, tetrahedra, count, {}, recipe)
