"""Real organs: from a surface in a file to a mesh of a wanted number of nodes."""

import hashlib
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.api.organs import attach
from studies.geometry.api.organs import fill as fill_mesh
from studies.geometry.files.content import Content
from studies.geometry.files.opening import opened
from studies.geometry.files.reading import weld
from studies.geometry.files.units import LARGEST, SMALLEST, Source, as_source, check_range
from studies.geometry.mesh.checks import check_finite, check_one_part, check_surface, check_volume
from studies.geometry.mesh.organ_mesh import OrganMesh, boundary_triangles
from studies.geometry.mesher.jobs import mesh_from
from studies.geometry.scanned.fidelity import warnings_of
from studies.geometry.shape.regions import Region, region_to_dict
from studies.geometry.surface.repair import Mended, border, mend


def scan(
    path: str | Path | Source,
    nodes: int | None = None,
    *,
    unit: str | None = None,
    smooth: float = 0.0,
    holes: bool = False,
    solid: float | None = None,
    wall: float | None = None,
    layers: int | None = None,
    fill: bool = True,
    regions: Mapping[str, Region] | None = None,
) -> OrganMesh:
    """A body from the surface in a file: welded, its largest part kept, oriented, and remeshed to `nodes` nodes.

    path: a file, or a Source, which also has a scale or a part. nodes: None keeps the file's own triangles. unit: of
    the file, one of UNITS; None: what the file says, or metres where only they make an organ of it. smooth: see
    scan_shape [m]; needs `nodes`. holes: close borders first. solid: fill what the surface encloses, openings up to
    that width [m] closed, for capsules and double walls; needs `nodes`. wall: thickness [m] of the wall of a hollow
    organ, in `layers` of elements; needs `nodes`. fill: with tetrahedra. regions: attachments; with `nodes` their
    outlines lie on edges. With `nodes` the mesh has the volume of the surface, and `losses` says how near it is to the
    file. Warns of every change to the surface. Raises StudyError for what cannot be read, mended or meshed.
    """
    source = as_source(path, unit)
    path = source.path
    content = opened(source)
    points, triangles = in_metres(source, content)
    welded = weld(points, triangles)
    # What a shell encloses needs no closed surface, and all parts of it.
    mended = mend(*welded, path.name, holes) if solid is None else Mended(*welded, ())
    for sentence in mended.remarks:
        warnings.warn(f"{path.name}: {sentence}", stacklevel=2)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    said = source.unit or content.unit or "m"
    recipe: dict[str, Any] = {"kind": "file", "name": path.stem, "file": path.name, "sha256": digest, "unit": said}
    recipe |= {"holes": bool(holes)} | source.recipe
    if nodes is None:
        if smooth or wall is not None or solid is not None:
            raise StudyError(
                f"{path.name}: smoothing, a wall and a filled shell need a new surface; say how many nodes it shall "
                "have (--nodes)"
            )
        body = as_it_is(mended, recipe, fill)
        return attach(body, regions) if regions else body
    if isinstance(nodes, bool) or not isinstance(nodes, int | np.integer):
        raise StudyError(f"{path.name}: {nodes!r} surface nodes asked for; give a whole number such as 550")
    if solid is None:
        check_watertight(mended, path.name)
    check_lengths(path.name, smooth, wall, solid)
    recipe |= {} if solid is None else {"solid": float(solid)}
    if wall is not None:
        recipe |= {"wall": float(wall)} | ({} if layers is None else {"layers": int(layers)})
    outlines = {key: region_to_dict(region) for key, region in (regions or {}).items()}
    recipe |= {"kind": "scan", "nodes": int(nodes), "smooth": float(smooth), "fill": bool(fill), "regions": outlines}
    mesh = mesh_from(recipe, {"points": mended.points, "triangles": mended.triangles})
    for sentence in warnings_of(mesh.losses):
        warnings.warn(f"{path.name}: {sentence}", stacklevel=2)
    return mesh


def check_lengths(name: str, smooth: float, wall: float | None, solid: float | None) -> None:
    """Raise StudyError unless the lengths [m] are such."""
    if not 0 <= smooth < np.inf:
        raise StudyError(f"{name}: smoothing over {1e3 * smooth:g} mm asked for; give 0 or a few millimetres")
    if solid is not None and not 0 <= solid < np.inf:
        raise StudyError(f"{name}: openings up to {1e3 * solid:g} mm shall be closed; give 0 or some millimetres")
    if wall is not None and not 0 < wall < np.inf:
        raise StudyError(f"{name}: a wall of {1e3 * wall:g} mm asked for; give a thickness above 0")


def raw_surface(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) in the file's unit and triangles (t, 3): of the surface, or the boundary of the tetrahedra.

    Raises StudyError for a file without them or with coordinates that are not finite.
    """
    return surface_of(opened(Source(path)), path.name)


def surface_of(content: Content, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of what a file holds; see raw_surface."""
    check_finite(content.points, name)
    solid = len(content.tetrahedra) > 0
    return content.points, boundary_triangles(content.tetrahedra) if solid else content.triangles


def in_metres(source: Source, content: Content) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) [m] and triangles (t, 3). Raises StudyError for no organ's size."""
    name = source.path.name
    points, triangles = surface_of(content, name)
    metres = source.metres(content.longest_side, content.unit)
    check_range(metres * content.longest_side, name, SMALLEST, LARGEST)
    return points * metres, triangles


def as_it_is(mended: Mended, recipe: dict[str, Any], fill: bool) -> OrganMesh:
    """The mended surface with the file's own triangles, filled when asked."""
    check_surface(mended.points, mended.triangles, recipe["file"])
    check_one_part(mended.triangles, recipe["file"])
    none = np.empty((0, 4), np.int64)
    surface = OrganMesh(recipe["name"], mended.points, mended.triangles, none, len(mended.points), {}, recipe)
    return fill_mesh(surface) if fill else surface


def check_watertight(mended: Mended, name: str) -> None:
    """Raise StudyError unless the surface has an inside: no border, and a volume."""
    left = len(border(mended.triangles))
    if left:
        raise StudyError(f"{name}: the surface is open at {left} edges; close the holes (--close-holes)")
    check_volume(mended.points, mended.triangles, name)
