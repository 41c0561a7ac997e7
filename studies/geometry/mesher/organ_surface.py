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


def organ_surface(shape: Shape, nodes: int, regions: list[Region], sides: str | None) -> Surface:
    """A surface with `nodes` nodes and the outline of every region on its edges.

    sides: None: evenly spread nodes; "straight" or "curved" (quadratic, with mid-side nodes on f = 0): even if that is
    near enough to the shape, else the nearest of those with spare nodes. Raises StudyError if none is well shaped, or
    an outline does not fit.
    """
    truth = first_surface(shape)
    with fresh_model():
        remesher = Remesher(*truth)
        surface = even(shape, nodes, regions, remesher, truth)
        if sides is None:
            return surface
        curved = sides == "curved"
        best = Fit(shape, surface, regions, truth, curved)
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
    """A surface with the share `spare` of its nodes where its shape needs them; None if none with `nodes` nodes is well
    shaped and has edges short enough for all regions."""
    for finer in ([], regions):
        try:
            remesher.finer_in(finer)  # edges half as long there
            count = max(FEWEST, nodes - min(round(spare * nodes), MOST_SPARE))
            base = relaxed(shape, *well_shaped(shape, truth, count, remesher))
            made = fitted(shape, base, nodes, regions, truth, curved)
        except StudyError:
            # No failure yet: shorter edges in the regions, another share or the even surface follow.
            continue
        if len(made.points) == nodes and all(is_met(region, *made.surface) for region in regions):
            return made
    return None


def even(shape: Shape, nodes: int, regions: list[Region], remesher: Remesher, start: Surface) -> Surface:
    """An even surface with `nodes` nodes and the outline of every region on its edges; remesher: of `start`, a fine
    surface. If edges are too long for a region, it is meshed again with edges half as long in the regions. Raises
    StudyError if none is well shaped, or an outline does not fit."""
    stage(f"a surface of {nodes} nodes")
    for region in regions:
        region.level(start[0][:1])  # an invalid region is refused here, not inside the mesher
    first = well_shaped(shape, start, nodes, remesher)
    try:
        surface = outlined(shape, *relaxed(shape, *first), regions)
        if all(is_met(region, *surface) for region in regions):
            return surface
    except StudyError:
        pass  # no failure yet: the finer surface that follows fits, or raises the same error
    remesher.finer_in(regions)
    area = float(triangle_areas(*start).sum())
    return outlined(shape, *relaxed(shape, *surface_with(nodes, area, remesher.mesh, shape)), regions)


def well_shaped(shape: Shape, start: Surface, nodes: int, remesher: Remesher) -> Surface:
    """An even surface of `nodes` nodes by the remesher of `start`, or by MMG from `start` if that fails. Raises
    StudyError if both fail."""
    area = float(triangle_areas(*start).sum())
    try:
        return surface_with(nodes, area, remesher.mesh, shape)
    except StudyError:
        # No failure yet: MMG makes one, or raises the same kind of error.
        return surface_with(nodes, area, EvenRemesher(*start, NEARNESS).mesh, shape)


def is_met(region: Region, points: np.ndarray, triangles: np.ndarray) -> bool:
    inside = region.level(points) <= ON_CURVE * np.linalg.norm(np.ptp(points, axis=0))
    return bool(inside[triangles].all(axis=1).any())


def relaxed(shape: Shape, points: np.ndarray, triangles: np.ndarray) -> Surface:
    fixed = np.zeros(len(points), bool)
    return relax(shape, points, triangles, None, fixed, fixed), triangles
