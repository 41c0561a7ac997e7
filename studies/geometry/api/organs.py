"""The meshes of the project by name, as scenes request them."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.geometry.mesh.checks import check_one_part, check_surface
from studies.geometry.mesh.organ_mesh import OrganMesh, unique_edges
from studies.geometry.mesh.quality import MIN_DIHEDRAL, dihedral_angles
from studies.geometry.mesh.second_order import CurvedMesh, make_curved
from studies.geometry.mesher.jobs import TIME_LIMIT, cached, mesh_from, patches_of
from studies.geometry.organs.make_shape import make_shape
from studies.geometry.shape.levelset import Shape
from studies.geometry.shape.regions import HalfSpace, Region, region_to_dict
from studies.geometry.surface.node_count import FEWEST, MOST


class PlaneCut(Protocol):
    """Where a body is cut: the part `within` of a plane, level = 0 of a half space; None: all of it."""

    @property
    def name(self) -> str:
        """Name of the cut."""
        ...

    @property
    def plane(self) -> HalfSpace:
        """Its front is where the level is positive."""
        ...

    @property
    def within(self) -> Region | None:
        """The blade: level <= 0. A half space has a straight front, a ball a disc inside the body."""
        ...


SIDES = ("straight", "curved")
"""Sides of elements that follow an organ's shape."""


def organ(
    name: str,
    nodes: int,
    regions: Mapping[str, Region] | None = None,
    fill: bool = True,
    parameters: Mapping[str, Any] | None = None,
    layers: int | None = None,
    exact: bool = False,
    sides: str | None = None,
    cuts: Sequence[PlaneCut] = (),
) -> OrganMesh:
    """The organ `name` of SHAPES with `nodes` nodes on its outer surface (exactly or within 2 %).

    Outlines of the regions (None: those of the organ) lie on edges. A hollow organ is filled between its surface and
    its lumen, in `layers` of prisms (None: so many that prisms are as high as long); with fill=False only the outer
    surface is made. exact: flat sides enclose exactly the organ's volume, with nodes slightly off its surface but
    outlines on it; else the nodes are on the surface and the volume is 1 to 12 % too small. sides: the kind of sides
    that are to follow the organ's shape, "straight" or "curved", with nodes placed for it; None: nodes are evenly
    spread. cuts: they lie on faces of the filled mesh, which is not opened; their sections must not meet. Raises
    StudyError when the mesher cannot.
    """
    if isinstance(nodes, bool) or not isinstance(nodes, int | np.integer):
        raise StudyError(f"{name}: {nodes!r} surface nodes asked for; give a whole number such as 550")
    if not FEWEST <= nodes <= MOST:  # checked here, before the mesher is loaded
        raise StudyError(f"{name}: {nodes} surface nodes asked for, but the mesher offers {FEWEST} to {MOST}")
    shape = make_shape(name, parameters or {})
    own = shape.regions if regions is None else regions
    recipe = {
        "kind": "organ",
        "name": name,
        "organ": name,
        "nodes": int(nodes),
        "parameters": dict(parameters or {}),
        "regions": {key: region_to_dict(region) for key, region in own.items()},
        "fill": bool(fill),
    } | ({"exact": True} if exact else {})
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


def organ_family(
    name: str,
    sizes: Sequence[int],
    regions: Mapping[str, Region] | None = None,
    fill: bool = True,
    parameters: Mapping[str, Any] | None = None,
    layers: int | None = None,
) -> list[OrganMesh]:
    """Meshes of the same shape, attached at the same places, with `sizes` nodes on the outer surface, coarsest first.

    Raises StudyError for one that cannot be made, and for sizes that do not grow.
    """
    if any(b <= a for a, b in pairwise(sizes)):
        raise StudyError(f"{name}: a family of meshes needs growing node counts, not {list(sizes)}")
    return [organ(name, nodes, regions, fill, parameters, layers) for nodes in sizes]


def curved(mesh: OrganMesh, may_fold: bool = False, shape: Shape | None = None) -> CurvedMesh:
    """The filled organ with second-order elements that follow its true shape, its lumen's too; cached.

    The vertices are those of `mesh`, and no element is folded anywhere, unless it `may_fold`. shape: the true shape of
    a scan, which its recipe does not contain. Raises StudyError for a mesh that is not filled, whose true shape is
    unknown, or that is too coarse to be curved.
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
    """Ball of `radius` [m] around the origin; surface nodes lie exactly on the sphere, so the volume is a little small
    (1 % at 550 nodes); raises StudyError for a radius or node count that cannot be meshed."""
    return organ("ball", nodes, regions or {}, fill, {"radius": float(radius)})


def liver(nodes: int = 550, regions: Mapping[str, Region] | None = None, fill: bool = True) -> OrganMesh:
    """Liver of about 1,500 mL, x to the patient's left, y to the back, z to the head; attached at LIVER_REGIONS unless
    other regions are given; raises StudyError for a node count that cannot be meshed."""
    return organ("liver", nodes, regions, fill)


def ball_octant(radius: float, h: float, h_pole: float) -> OrganMesh:
    """Octant x, y, z >= 0 of a ball [m], element size `h_pole` [m] at the pole (0, 0, radius) growing to `h` [m] one
    radius away. Patches: "x0", "y0", "z0" (exactly coordinate 0) and "sphere". Raises StudyError for sizes outside
    0.005 to 1 of the radius."""
    for name, size in (("h", h), ("h_pole", h_pole)):
        if not 0.005 * radius <= size <= radius:
            raise StudyError(
                f"the octant's {name} = {size} m is outside 0.005 to 1 of its radius {radius} m; choose one inside"
            )
    recipe = {
        "kind": "ball_octant",
        "name": "ball_octant",
        "radius": float(radius),
        "h": float(h),
        "h_pole": float(h_pole),
    }
    mesh = mesh_from(recipe)
    surface = mesh.points[: mesh.surface_count]
    patches = {f"{axis}0": np.flatnonzero(surface[:, k] == 0.0) for k, axis in enumerate("xyz")}
    patches["sphere"] = np.flatnonzero(np.abs(np.linalg.norm(surface, axis=1) - radius) < 1e-12 * radius)
    return replace(mesh, patches=patches)


def fill(surface: OrganMesh, limit: float = TIME_LIMIT) -> OrganMesh:
    """The given closed surface filled with tetrahedra, its nodes kept bit for bit and numbered first.

    Gives up after `limit` seconds. Raises StudyError for a surface that is not closed, outward and well shaped, or that
    cannot be filled (it cuts itself).
    """
    points = np.ascontiguousarray(surface.points[: surface.surface_count], dtype=float)
    triangles = np.ascontiguousarray(surface.triangles, dtype=np.int64)
    check_surface(points, triangles, surface.name)
    check_one_part(triangles, surface.name)
    recipe = {
        "kind": "fill",
        "name": surface.name,
        "regions": surface.recipe.get("regions", {}),
        "source": surface.recipe,
    }
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
    """The mesh with the surface nodes inside the regions as patches, for a file's own triangles.

    No node moves, so the outline is a staircase of its edges. Raises StudyError for a region without nodes.
    """
    data = {key: region_to_dict(region) for key, region in regions.items()}
    return replace(mesh, patches=patches_of(mesh, data), recipe=mesh.recipe | {"regions": data})
