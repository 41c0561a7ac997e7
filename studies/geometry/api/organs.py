"""The meshes of the project by name, for scenes."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.geometry.mesh.checks import check_one_part, check_surface
from studies.geometry.mesh.organ_mesh import OrganMesh, unique_edges
from studies.geometry.mesh.quality import MIN_DIHEDRAL, dihedral_angles
from studies.geometry.mesh.second_order import CurvedMesh, make_curved
from studies.geometry.mesher.jobs import TIME_LIMIT, cached, mesh_from, patches_of
from studies.geometry.organs import make_shape
from studies.geometry.shape.levelset import Shape
from studies.geometry.shape.regions import Region, region_to_dict
from studies.geometry.surface.node_count import FEWEST, MOST

SIDES = ("straight", "curved")
"""Kinds of element sides for which nodes can be placed."""


def organ(
    name: str,
    nodes: int,
    regions: Mapping[str, Region] | None = None,
    fill: bool = True,
    parameters: Mapping[str, Any] | None = None,
    layers: int | None = None,
    exact: bool = False,
    sides: str | None = None,
    cuts: Sequence[Any] = (),
) -> OrganMesh:
    """Mesh of the organ `name` of SHAPES with `nodes` nodes on its outer surface, exactly or within 2 % or 5 nodes.

    regions: attachments, whose outlines lie on edges; None: the default ones of the organ. fill: with tetrahedra; else
    the mesh is the outer surface only. parameters: of the shape function, [m] for the ball and [mm] for the others.
    layers: of prisms between surface and lumen of a hollow organ; None: so many that prisms are about as high as long.
    exact: the flat sides enclose the volume of the organ, with nodes slightly off its surface; else the nodes lie on
    the surface, and the volume is 1 to 12 % too small. sides: "straight" or "curved" places nodes so that sides of this
    kind follow the shape; None: nodes are evenly spread. cuts: objects with `name`, `plane` (HalfSpace) and `within`
    (the blade, where level <= 0: a half space has a straight front, a ball a disc; None: the whole section), which lie
    on faces of the filled mesh, which is not opened. Raises StudyError for an invalid argument and if the mesher fails.
    """
    if isinstance(nodes, bool) or not isinstance(nodes, int | np.integer):
        raise StudyError(f"{name}: {nodes!r} surface nodes asked for; give a whole number such as 550")
    if not FEWEST <= nodes <= MOST:  # before the mesher is loaded
        raise StudyError(f"{name}: {nodes} surface nodes asked for, but the mesher offers {FEWEST} to {MOST}")
    shape = make_shape(name, parameters or {})
    own = shape.regions if regions is None else regions
    outlines = {key: region_to_dict(region) for key, region in own.items()}
    recipe = {"kind": "organ", "name": name, "organ": name, "nodes": int(nodes), "parameters": dict(parameters or {})}
    recipe |= {"regions": outlines, "fill": bool(fill)} | ({"exact": True} if exact else {})
    if cuts and not fill:
        raise StudyError(f"{name}: cut {cuts[0].name!r} is for an organ that is filled; surfaces are not cut yet")
    sheets = [
        {"name": cut.name, "plane": region_to_dict(cut.plane), "within": cut.within and region_to_dict(cut.within)}
        for cut in cuts
    ]
    recipe |= {"cut": sheets[0]} if len(sheets) == 1 else {"cuts": sheets} if sheets else {}
    recipe |= {} if sides is None else {"sides": lookup(sides, SIDES, "kind of sides")}
    if layers is not None:
        if shape.wall is None:
            raise StudyError(f"{name}: {layers} layers asked for, but it is solid; only a hollow organ has layers")
        recipe["layers"] = int(layers)
    return mesh_from(recipe)


def curved(mesh: OrganMesh, may_fold: bool = False, shape: Shape | None = None) -> CurvedMesh:
    """Second-order mesh of a filled organ, whose sides follow its true shape and that of its lumen; cached.

    The vertices are those of `mesh`. may_fold: whether folded elements are accepted. shape: the true shape of a scan,
    which its recipe does not contain. Raises StudyError for a mesh that is not filled, of unknown shape, or (unless
    `may_fold`) too coarse to be curved without a fold.
    """
    arrays = {"points": mesh.points, "tetrahedra": mesh.tetrahedra}
    if shape is not None and mesh.recipe["kind"] == "scan":
        # The deviation of the straight sides from the shape identifies the shape.
        arrays["depths"] = shape.level(mesh.points[unique_edges(mesh.triangles)].mean(axis=1))
    recipe = {"kind": "curved", "name": f"{mesh.name}-curved", "source": mesh.recipe}
    if may_fold:
        recipe["may_fold"] = True

    def make() -> dict[str, np.ndarray]:
        made = make_curved(mesh, may_fold, shape)
        return {"points": made.points, "cells": made.cells}

    stored = cached(recipe, arrays, ("points", "cells"), make)
    return CurvedMesh(stored["points"], stored["cells"], len(mesh.points))


def ball(
    nodes: int = 550, radius: float = 0.05, regions: Mapping[str, Region] | None = None, fill: bool = True
) -> OrganMesh:
    """Ball of `radius` [m] around the origin with `nodes` surface nodes, which lie on the sphere, so the volume is a
    little too small (1 % at 550 nodes). regions: attachments; None: none. Raises StudyError as `organ`."""
    return organ("ball", nodes, regions or {}, fill, {"radius": float(radius)})


def liver(nodes: int = 550, regions: Mapping[str, Region] | None = None, fill: bool = True) -> OrganMesh:
    """Liver of about 1,500 mL with `nodes` surface nodes; x to the patient's left, y to the back, z to the head.
    regions: attachments; None: LIVER_REGIONS. Raises StudyError as `organ`."""
    return organ("liver", nodes, regions, fill)


def ball_octant(radius: float, h: float, h_pole: float) -> OrganMesh:
    """Octant x, y, z >= 0 of a ball of `radius` [m] around the origin, filled, with elements from `h_pole` [m] at the
    pole (0, 0, radius) to `h` [m] at a distance of one radius.

    Patches: "x0", "y0", "z0", whose coordinate is exactly 0, and "sphere". Raises StudyError for sizes outside 0.005 to
    1 of the radius.
    """
    for name, size in (("h", h), ("h_pole", h_pole)):
        if not 0.005 * radius <= size <= radius:
            raise StudyError(
                f"the octant's {name} = {size} m is outside 0.005 to 1 of its radius {radius} m; choose one inside"
            )
    sizes = {"radius": float(radius), "h": float(h), "h_pole": float(h_pole)}
    mesh = mesh_from({"kind": "ball_octant", "name": "ball_octant"} | sizes)
    surface = mesh.points[: mesh.surface_count]
    patches = {f"{axis}0": np.flatnonzero(surface[:, k] == 0.0) for k, axis in enumerate("xyz")}
    patches["sphere"] = np.flatnonzero(np.abs(np.linalg.norm(surface, axis=1) - radius) < 1e-12 * radius)
    return replace(mesh, patches=patches)


def fill(surface: OrganMesh, limit: float = TIME_LIMIT) -> OrganMesh:
    """A closed surface filled with tetrahedra; its nodes stay the same bit for bit and are numbered first.

    limit: processor time [s]. Warns of a dihedral angle below MIN_DIHEDRAL. Raises StudyError for a surface that is not
    one closed, outward part without slivers, that intersects itself, or that cannot be filled within the limit.
    """
    points = np.ascontiguousarray(surface.points[: surface.surface_count], dtype=float)
    triangles = np.ascontiguousarray(surface.triangles, dtype=np.int64)
    check_surface(points, triangles, surface.name)
    check_one_part(triangles, surface.name)
    regions = surface.recipe.get("regions", {})
    recipe = {"kind": "fill", "name": surface.name, "regions": regions, "source": surface.recipe}
    mesh = mesh_from(recipe, {"points": points, "triangles": triangles}, limit)
    angle = float(dihedral_angles(mesh.points, mesh.tetrahedra).min())
    if angle < MIN_DIHEDRAL:
        warnings.warn(
            f"{surface.name}: the flattest tetrahedron has a dihedral angle of {angle:.2g} degrees "
            f"(under {MIN_DIHEDRAL:g}); remesh the surface more evenly",
            stacklevel=2,
        )
    return mesh


def attach(mesh: OrganMesh, regions: Mapping[str, Region]) -> OrganMesh:
    """The mesh with patches: the outer surface nodes that lie in each region. No node moves, so the outline of a patch
    is a staircase of edges. Raises StudyError for a region without nodes or of an unknown kind."""
    data = {key: region_to_dict(region) for key, region in regions.items()}
    return replace(mesh, patches=patches_of(mesh, data), recipe=mesh.recipe | {"regions": data})
