"""The surface of an organ with a given number of nodes: evenly spread, or where its shape needs them."""

import mmgpy
import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import Surface, compact, triangle_areas
from studies.geometry.mesher.gmsh_calls import Remesher, fresh_model
from studies.geometry.mesher.process import stage
from studies.geometry.shape.levelset import Shape
from studies.geometry.shape.regions import ON_CURVE, Region
from studies.geometry.surface.first_surface import first_surface
from studies.geometry.surface.fit import Fit, fitted
from studies.geometry.surface.node_count import FEWEST, surface_with
from studies.geometry.surface.snap import outlined, relax

NEARNESS = 0.2
"""Largest distance of MMG from the first triangulation, over the edge length."""
SPARES = (0.22, 0.1, 0.18, 0.26, 0.14)
"""Shares of spare nodes, tried in turn. They go where the surface of the even nodes is farthest from its shape."""
MOST_SPARE = 120
"""Most spare nodes: the even nodes of a large mesh are near the shape already."""
QUIET, NO_RIDGES = -1, 0
"""Options of MMG: no angle between triangles is kept as a ridge, because the facets of a scan are arbitrary."""


class EvenRemesher:
    """A surface that is meshed with any number of sizes by MMG, which splits, collapses and flips edges.

    MMG needs no map of the surface onto a plane, so it handles thin flaps and margins, on which the maps of gmsh fold
    and its mesher hardly ends. C. Dapogny, C. Dobrzynski, P. Frey: Three-dimensional adaptive domain remeshing,
    implicit domain meshing, and applications to free and moving boundary problems, J. Comput. Phys. 262, 2014.
    """

    def __init__(self, points: np.ndarray, triangles: np.ndarray, nearness: float):
        """points (n, 3) [m], triangles (t, 3): a closed outward triangulation; nearness: largest distance of an edit
        from it, over the edge length."""
        self.nearness = nearness
        self.points, self.triangles = np.ascontiguousarray(points), np.ascontiguousarray(triangles, dtype=np.int32)

    def mesh(self, size: float) -> Surface:
        """Points (n, 3) [m] near the surface and outward triangles (t, 3) with edges of about `size` [m]."""
        mesh = mmgpy.MmgMeshS(self.points, self.triangles)
        mesh.remesh(hsiz=size, hausd=self.nearness * size, angle=NO_RIDGES, verbose=QUIET)
        return compact(np.asarray(mesh.get_vertices(), float), np.asarray(mesh.get_triangles()))


def close_surface(shape: Shape, nodes: int, regions: list[Region], curved: bool) -> Surface:
    """A surface with `nodes` nodes that follows its shape, with the outline of every region on its edges.

    The nodes are even if that is near enough to the shape; else it is the nearest surface of those with spare nodes.
    curved: the sides will be quadratic, with mid-side nodes on f = 0. Raises StudyError if none is well shaped.
    """
    truth = first_surface(shape)
    with fresh_model():
        remesher = Remesher(*truth)
        best = Fit(shape, even(shape, nodes, regions, remesher, truth), regions, truth, curved)
        badness = best.badness()
        for spare in SPARES:
            if badness <= 1.0:
                break
            stage(f"a surface of {nodes} nodes that follows its shape")
            made = follow(shape, nodes, regions, remesher, truth, curved, spare)
            if made is not None and made.badness() < badness:
                best, badness = made, made.badness()
    return best.surface


def follow(
    shape: Shape, nodes: int, regions: list[Region], remesher: Remesher, truth: Surface, curved: bool, spare: float
) -> Fit | None:
    """A surface with the share `spare` of its nodes where its shape needs them.

    None if no surface with `nodes` nodes is well shaped and has edges short enough for all regions.
    """
    for finer in ([], regions):
        try:
            base = base_surface(
                shape, remesher, truth, max(FEWEST, nodes - min(round(spare * nodes), MOST_SPARE)), finer
            )
            made = fitted(shape, base, nodes, regions, truth, curved)
        except StudyError:
            # No failure yet: shorter edges in the regions, another share or the even surface follow.
            continue
        if len(made.points) == nodes and all(is_met(region, *made.surface) for region in regions):
            return made
    return None


def base_surface(shape: Shape, remesher: Remesher, start: Surface, nodes: int, finer: list[Region]) -> Surface:
    """An even surface with `nodes` nodes without outlines, with edges half as long in the regions `finer`.

    remesher: of `start`, a fine surface. Raises StudyError if none is well shaped.
    """
    remesher.finer_in(finer)
    points, triangles = well_shaped(shape, start, nodes, remesher)
    fixed = np.zeros(len(points), bool)
    return relax(shape, points, triangles, None, fixed, fixed), triangles


def even_surface(shape: Shape, nodes: int, regions: list[Region]) -> Surface:
    """An even surface with `nodes` nodes and the outline of every region on its edges. Raises StudyError as `even`."""
    start = first_surface(shape)
    with fresh_model():
        return even(shape, nodes, regions, Remesher(*start), start)


def even(shape: Shape, nodes: int, regions: list[Region], remesher: Remesher, start: Surface) -> Surface:
    """An even surface with `nodes` nodes and the outline of every region on its edges.

    remesher: of `start`, a fine surface. If edges are too long for a region, the surface is meshed again with edges
    half as long in the regions. Raises StudyError if none is well shaped, or an outline does not fit.
    """
    stage(f"a surface of {nodes} nodes")
    for region in regions:
        region.level(start[0][:1])  # an invalid region is refused here, not inside the mesher
    surface = snap_if_it_fits(shape, *well_shaped(shape, start, nodes, remesher), regions)
    if surface is None:
        remesher.finer_in(regions)
        surface = snap_all(shape, *surface_with(nodes, area_of(start), remesher.mesh, shape), regions)
    return surface


def area_of(surface: Surface) -> float:
    return float(triangle_areas(*surface).sum())


def well_shaped(shape: Shape, start: Surface, nodes: int, remesher: Remesher) -> Surface:
    """An even surface of `nodes` nodes by the remesher of `start`, or by MMG from `start` if that fails.

    Raises StudyError if both fail.
    """
    try:
        return surface_with(nodes, area_of(start), remesher.mesh, shape)
    except StudyError:
        # No failure yet: MMG makes one, or raises the same kind of error.
        return surface_with(nodes, area_of(start), EvenRemesher(*start, NEARNESS).mesh, shape)


def snap_if_it_fits(shape: Shape, points: np.ndarray, triangles: np.ndarray, regions: list[Region]) -> Surface | None:
    """The surface with its outlines, or None if its edges are too long for one of the regions."""
    try:
        surface = snap_all(shape, points, triangles, regions)
    except StudyError:
        # No failure yet: the finer surface that follows fits or raises the same error.
        return None
    return surface if all(is_met(region, *surface) for region in regions) else None


def is_met(region: Region, points: np.ndarray, triangles: np.ndarray) -> bool:
    inside = region.level(points) <= ON_CURVE * np.linalg.norm(np.ptp(points, axis=0))
    return bool(inside[triangles].all(axis=1).any())


def snap_all(shape: Shape, points: np.ndarray, triangles: np.ndarray, regions: list[Region]) -> Surface:
    """The surface after relaxation, with the outline of every region. Raises StudyError if an outline does not fit."""
    fixed = np.zeros(len(points), bool)
    points = relax(shape, points, triangles, None, fixed, fixed)
    return outlined(shape, points, triangles, regions)
