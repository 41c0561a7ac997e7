"""Real organs: from a surface in a file to a mesh with a chosen number of nodes."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.api.organs import attach
from studies.geometry.api.organs import fill as fill_mesh
from studies.geometry.files.checked_reading import marked_nodes, weld, with_patches
from studies.geometry.files.content import Content
from studies.geometry.files.opening import opened
from studies.geometry.files.units import (
    FAR_AWAY,
    LARGEST,
    LEAST_VOLUME,
    SMALLEST,
    Source,
    as_source,
    check_range,
    stem_of,
)
from studies.geometry.mesh.checks import check_finite, check_one_part, check_surface, check_volume
from studies.geometry.mesh.organ_mesh import OrganMesh, boundary_triangles, signed_volume
from studies.geometry.mesher.jobs import LEVEL, TIME_LIMIT, cached, mesh_from, run_worker
from studies.geometry.scanned.fidelity import spread, warnings_of
from studies.geometry.scanned.level_grid import grid_from, shape_of
from studies.geometry.shape.levelset import Shape
from studies.geometry.shape.regions import PaintedRegion, Region, region_to_dict
from studies.geometry.surface.painted import painted_region
from studies.geometry.surface.repair import RepairedSurface, border, mend

LEVEL_KEYS = ("name", "solid", "smooth")
"""Keys of a recipe on which the true shape depends, in addition to the surface."""


@dataclass(frozen=True)
class Remeshing:
    """Operations on the surface of a file before it is meshed; lengths in [m]."""

    smooth: float = 0.0
    """Size up to which folds are closed and bumps are smoothed (scan_shape.levelled); needs a number of nodes."""
    holes: bool = False
    """Whether borders are closed first, each by a fan of triangles over the mean of its nodes."""
    solid: float | None = None
    """The body is what the surface encloses when openings up to this width are closed, for capsules and double walls;
    needs a number of nodes."""
    wall: float | None = None
    """Thickness of the wall of a hollow organ; needs a number of nodes."""
    layers: int | None = None
    """Layers of prisms in the wall; None: so many that the prisms are about as high as long."""
    on_shape: bool = False
    """Whether nodes lie on the true shape (true_shape_of), for sides that are curved onto it later; else the flat sides
    enclose the volume."""

    def check_count(self, nodes: int | None, name: str) -> None:
        if nodes is None and (self.smooth or self.wall is not None or self.solid is not None):
            raise StudyError(
                f"{name}: smoothing, a wall and a filled shell need a new surface; set its number of nodes (--nodes)"
            )
        if nodes is not None and (isinstance(nodes, bool) or not isinstance(nodes, int | np.integer)):
            raise StudyError(f"{name}: {nodes!r} surface nodes asked for; give a whole number such as 550")

    @property
    def recipe(self) -> dict[str, Any]:
        """The fields that change a remeshed body, except `holes`; JSON-able."""
        given: dict[str, Any] = {"smooth": float(self.smooth)}
        if self.solid is not None:
            given["solid"] = float(self.solid)
        if self.wall is not None:
            given |= {"wall": float(self.wall)} | ({} if self.layers is None else {"layers": int(self.layers)})
        return given | ({"on_shape": True} if self.on_shape else {})


def scan(
    path: str | Path | Source,
    nodes: int | None = None,
    *,
    unit: str | None = None,
    fill: bool = True,
    regions: Mapping[str, Region] | None = None,
    **how: Any,
) -> OrganMesh:
    """A body from the surface in a file, which is welded, reduced to its largest part, oriented and remeshed.

    path: a file, or a Source, which also has a scale or a part. nodes: on the outer surface; None keeps the triangles
    of the file. unit: of the file, one of UNITS; None: the one that the file states, or metres if only metres give the
    size of an organ. fill: with tetrahedra. regions: attachments, whose outlines lie on edges if `nodes` is given;
    None: those painted in the file as point data `patch_NAME`. how: the fields of Remeshing. With `nodes`, `losses`
    states how far the mesh deviates from the file, and unless `on_shape` the mesh has the volume of the surface. Warns
    of every change to the surface. Raises StudyError for a file that cannot be read, repaired or meshed, and TypeError
    for an unknown field.
    """
    source, remeshing = as_source(path, unit), Remeshing(**how)
    name, content = source.path.name, opened(source)
    surface, recipe = repaired_surface(source, content, remeshing)
    remeshing.check_count(nodes, name)
    if nodes is None:
        check_surface(surface.points, surface.triangles, name)
        check_one_part(surface.triangles, name)
        warn_if_small(signed_volume(surface.points, surface.triangles), name)
        none = np.empty((0, 4), np.int64)
        body = OrganMesh(recipe["name"], surface.points, surface.triangles, none, len(surface.points), {}, recipe)
        body = fill_mesh(body) if fill else body
        if regions is None:
            return with_patches(body, content, source.metres(content.longest_side, content.unit))
        return attach(body, regions) if regions else body
    check_remeshing(surface, remeshing, name)
    if regions is None:
        regions = {key: painted_on(source, content, key) for key in marked_nodes(content)}
    outlines = {key: region_to_dict(region) for key, region in regions.items()}
    recipe |= remeshing.recipe | {"kind": "scan", "nodes": int(nodes), "fill": bool(fill), "regions": outlines}
    grid = level_arrays(recipe, surface) if remeshing.on_shape else {}
    mesh = mesh_from(recipe, {"points": surface.points, "triangles": surface.triangles} | grid)
    mesh = replace(mesh, losses=with_file(mesh, surface))
    warn_if_small(mesh.volume + mesh.lumen_volume, name)
    for sentence in warnings_of(mesh.losses, filled=remeshing.solid is not None):
        warnings.warn(f"{name}: {sentence}", stacklevel=2)
    return mesh


def with_file(mesh: OrganMesh, surface: RepairedSurface) -> dict[str, Any]:
    """The losses of a mesh, its volume compared with that of the whole file, less the lumens where both have some."""
    losses = dict(mesh.losses)
    if surface.lumen is not None and mesh.hollow:
        inner = (mesh.points, mesh.lumen_triangles)
        losses |= {"lumen": spread(surface.lumen, inner), "volume_mesh": losses["volume_mesh"] - mesh.lumen_volume}
    elif surface.lumen is not None:
        return losses  # the outer surfaces alone
    return losses if np.isnan(surface.volume) else losses | {"volume_file": surface.volume}


def painted(path: str | Path | Source, name: str, unit: str | None = None) -> PaintedRegion:
    """The region painted on the surface in a file, where the point data `patch_NAME` are above 0: the same for every
    mesh of the organ and for both solvers.

    name: without the prefix. path, unit: as in `scan`. Raises StudyError for a file that cannot be read, that has no
    such data, or whose nodes are all inside or all outside.
    """
    source = as_source(path, unit)
    return painted_on(source, opened(source), name)


def painted_on(source: Source, content: Content, name: str) -> PaintedRegion:
    marked, file = marked_nodes(content), source.path.name
    if name not in marked:
        patches = f"the patches {', '.join(marked)}" if marked else "no point data called patch_NAME"
        raise StudyError(f"{file} has {patches}; there is no '{name}' among them")
    return painted_region(*in_metres(source, content), marked[name], f"{file}: the painted patch '{name}'")


def true_shape_of(source: Source, **how: Any) -> Shape:
    """The true shape of the surface in a file, the same for meshes of any number of nodes.

    It has the volume of the surface, unless parts of it overlap or are lost (scan_shape.target_volume). how: the fields
    of Remeshing. Raises StudyError for a file that cannot be read or repaired, and TypeError for an unknown field.
    """
    remeshing = Remeshing(**how)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # `scan` warns of every change
        surface, recipe = repaired_surface(source, opened(source), remeshing)
    check_remeshing(surface, remeshing, source.path.name)
    recipe |= remeshing.recipe
    return shape_of(grid_from(level_arrays(recipe, surface)), recipe["name"], remeshing.wall)


def level_arrays(recipe: Mapping[str, Any], surface: RepairedSurface) -> dict[str, np.ndarray]:
    """The grid of the true shape of a repaired surface (jobs.LEVEL); recipe: of a scan."""
    deciding = {key: recipe[key] for key in LEVEL_KEYS if key in recipe} | {"kind": "level"}
    given = {"points": surface.points, "triangles": surface.triangles}
    return cached(deciding, given, LEVEL, lambda: run_worker(deciding, given, TIME_LIMIT))


def repaired_surface(source: Source, content: Content, remeshing: Remeshing) -> tuple[RepairedSurface, dict[str, Any]]:
    """The surface of a file [m], welded and (without `solid`) repaired, and the recipe of the file. Warns of every
    change. Raises StudyError for a surface that cannot be repaired or has the size of no organ."""
    path = source.path
    welded = weld(*in_metres(source, content))
    if remeshing.solid is None:
        surface = mend(*welded, path.name, remeshing.holes)
        surface = replace(surface, remarks=(*surface.remarks, *kept_hollow(surface, remeshing, path.name)))
    else:  # `solid` needs all parts of the surface, which may be open
        volume = float("nan") if len(border(welded[1])) else abs(signed_volume(*welded))
        surface = RepairedSurface(*welded, (), volume)
    for sentence in surface.remarks:
        warnings.warn(f"{path.name}: {sentence}", stacklevel=3)
    identity = {"sha256": source.sha256, "unit": source.unit or content.unit or "m"}
    recipe: dict[str, Any] = {"kind": "file", "name": stem_of(path), "file": path.name} | identity
    return surface, recipe | {"holes": bool(remeshing.holes)} | source.recipe


def kept_hollow(surface: RepairedSurface, how: Remeshing, name: str) -> list[str]:
    """A remark on the lumen of a surface that gets a wall; [] for a solid one. Raises StudyError without a wall, which
    would fill the lumen."""
    outer = signed_volume(surface.points, surface.triangles)
    if surface.lumen is not None:
        lumen = abs(signed_volume(*surface.lumen))
        if how.wall is not None:
            return [f"its lumen of {1e6 * lumen:.4g} mL becomes that of an even wall of {1e3 * how.wall:.4g} mm"]
        what = f"a lumen of {1e6 * lumen:.4g} mL in {1e6 * (outer - lumen):.4g} mL of tissue"
    elif surface.nested and how.wall is None:
        lumen = surface.nested
        what = f"a closed surface of {1e6 * lumen:.4g} mL in one of {1e6 * outer:.4g} mL: a lumen, or another body"
    else:
        return []
    wall = 1e3 * wall_round(surface, lumen)
    raise StudyError(
        f"{name} has {what}; --wall {wall:g} with --nodes keeps it hollow, as an even wall of the same volume, and "
        "--solid 0 fills it"
    )


def wall_of(source: Source) -> float | None:
    """Thickness [m] of the even wall that keeps the lumens of a file; None for a solid one. Raises StudyError for a
    file that cannot be read or repaired."""
    surface = mend(*weld(*in_metres(source, opened(source))), source.path.name)
    return None if surface.lumen is None else wall_round(surface, abs(signed_volume(*surface.lumen)))


def wall_round(surface: RepairedSurface, lumen: float) -> float:
    """Thickness [m], to three digits, of the even wall round a lumen of this volume [m³]."""
    from studies.geometry.scanned.distance_grid import even_wall  # loads compiled code

    return 1e-3 * float(f"{1e3 * even_wall(surface.points, surface.triangles, lumen):.3g}")


def in_metres(source: Source, content: Content) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) [m] and triangles (t, 3) of the surface of a file, or of the boundary of its tetrahedra.

    Raises StudyError for coordinates that are not finite, for a size that no organ has, for a body too far from the
    origin, and if the unit is unknown.
    """
    name, points = source.path.name, content.points
    check_finite(points, name)
    triangles = boundary_triangles(content.tetrahedra) if len(content.tetrahedra) else content.triangles
    metres = source.metres(content.longest_side, content.unit)
    check_range(metres * content.longest_side, name, SMALLEST, LARGEST)
    distance = metres * float(np.linalg.norm(points.mean(axis=0)))
    if distance > FAR_AWAY:
        raise StudyError(
            f"{name}: it lies {distance:.3g} m from the origin of its coordinates, where coordinates lose "
            "precision; move it to the origin in the program that made it"
        )
    return points * metres, triangles


def check_remeshing(surface: RepairedSurface, how: Remeshing, name: str) -> None:
    """Raise StudyError unless the surface is closed and encloses a volume (of a shell to be filled nothing is asked),
    and for a length that is not finite or too small."""
    if how.solid is None:
        left = len(border(surface.triangles))
        if left:
            raise StudyError(f"{name}: the surface is open at {left} edges; close the holes (--close-holes)")
        check_volume(surface.points, surface.triangles, name)
    if not 0 <= how.smooth < np.inf:
        raise StudyError(f"{name}: smoothing over {1e3 * how.smooth:g} mm asked for; give 0 or a few millimetres")
    if how.solid is not None and not 0 <= how.solid < np.inf:
        raise StudyError(f"{name}: cannot close openings of {1e3 * how.solid:g} mm; give 0 or a few millimetres")
    if how.wall is not None and not 0 < how.wall < np.inf:
        raise StudyError(f"{name}: a wall of {1e3 * how.wall:g} mm asked for; give a thickness above 0")


def warn_if_small(volume: float, name: str) -> None:
    if abs(volume) < LEAST_VOLUME:
        warnings.warn(
            f"{name}: the surface encloses {1e6 * volume:.2g} mL, as organs of small animals do; if it is none, "
            "correct the unit or the scale, or choose another --part",
            stacklevel=3,
        )
