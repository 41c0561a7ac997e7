"""The surface of an organ with a wanted number of nodes: evenly spread, or where its shape needs them."""

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import triangle_areas
from studies.geometry.mesher.gmsh_calls import Remesher, fresh_model
from studies.geometry.mesher.mmg_calls import EvenRemesher
from studies.geometry.mesher.progress import stage
from studies.geometry.shape.levelset import Shape
from studies.geometry.shape.regions import ON_CURVE, Region
from studies.geometry.surface.first_surface import first_surface
from studies.geometry.surface.fit import Fit, fitted
from studies.geometry.surface.node_count import FEWEST, Surface, surface_with
from studies.geometry.surface.snap import outlined, relax

NEARNESS = 0.2
"""Distance to the first triangulation, over the size, that MMG keeps to."""
SPARES = (0.22, 0.1, 0.18, 0.26, 0.14)
"""Shares of the nodes that are put where even ones leave the surface farthest from its shape, tried in turn."""
MOST_SPARE = 120
"""So many at most: where shares of a large mesh are more, its even nodes are near the shape already."""


def close_surface(shape: Shape, nodes: int, regions: list[Region], curved: bool) -> Surface:
    """A surface with `nodes` nodes that follows its shape, every region's outline on its edges: even where that is near
    enough, else the nearest that spare nodes make. curved: the sides will be quadratic, their middles on f = 0.

    Raises StudyError when none is well shaped."""
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
    """A surface of which the share `spare` of its nodes is where its shape needs them; None where edges stay too long
    for one of the regions."""
    for finer in ([], regions):
        try:
            base = base_surface(
                shape, remesher, truth, max(FEWEST, nodes - min(round(spare * nodes), MOST_SPARE)), finer
            )
            made = fitted(shape, base, nodes, regions, truth, curved)
        except StudyError:
            # Not lost: shorter edges in the regions, another share or the even surface follow.
            continue
        if len(made.points) == nodes and all(is_met(region, *made.surface) for region in regions):
            return made
    return None


def base_surface(shape: Shape, remesher: Remesher, start: Surface, nodes: int, finer: list[Region]) -> Surface:
    """An even surface with `nodes` nodes and no outline, its edges half as long in the regions `finer`; remesher: of
    `start`, a fine surface.

    Raises StudyError when none is well shaped."""
    remesher.finer_in(finer)
    points, triangles = well_shaped(shape, start, nodes, remesher)
    fixed = np.zeros(len(points), bool)
    return relax(shape, points, triangles, None, fixed, fixed), triangles


def even_surface(shape: Shape, nodes: int, regions: list[Region]) -> Surface:
    """An even surface with `nodes` nodes and every region's outline on its edges."""
    start = first_surface(shape)
    with fresh_model():
        return even(shape, nodes, regions, Remesher(*start), start)


def even(shape: Shape, nodes: int, regions: list[Region], remesher: Remesher, start: Surface) -> Surface:
    """An even surface with `nodes` nodes and every region's outline on its edges; remesher: of `start`, a fine surface.

    Where edges are too long for a region, the surface is meshed again with edges half as long in the regions."""
    stage(f"a surface of {nodes} nodes")
    for region in regions:
        region.level(start[0][:1])  # a region that is none is refused here, not inside the mesher
    surface = snap_if_it_fits(shape, *well_shaped(shape, start, nodes, remesher), regions)
    if surface is None:
        remesher.finer_in(regions)
        surface = snap_all(shape, *surface_with(nodes, area_of(start), remesher.mesh, shape), regions)
    return surface


def area_of(surface: Surface) -> float:
    """The area of a surface [m²]."""
    return float(triangle_areas(*surface).sum())


def well_shaped(shape: Shape, start: Surface, nodes: int, remesher: Remesher) -> Surface:
    """An even surface of `nodes` nodes by the remesher of `start`; where it makes none, by MMG from `start`."""
    try:
        return surface_with(nodes, area_of(start), remesher.mesh, shape)
    except StudyError:
        # Not lost: MMG makes one, or gives a sentence of the same kind.
        return surface_with(nodes, area_of(start), EvenRemesher(*start, NEARNESS).mesh, shape)


def snap_if_it_fits(shape: Shape, points: np.ndarray, triangles: np.ndarray, regions: list[Region]) -> Surface | None:
    """The surface with its outlines, or None when its edges are too long for one of the regions."""
    try:
        surface = snap_all(shape, points, triangles, regions)
    except StudyError:
        # Not lost: the finer surface that follows either fits or gives the same message.
        return None
    return surface if all(is_met(region, *surface) for region in regions) else None


def is_met(region: Region, points: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether some triangle lies inside the region, outline included."""
    inside = region.level(points) <= ON_CURVE * np.linalg.norm(np.ptp(points, axis=0))
    return bool(inside[triangles].all(axis=1).any())


def snap_all(shape: Shape, points: np.ndarray, triangles: np.ndarray, regions: list[Region]) -> Surface:
    """Even out the surface, then give every region its outline."""
    fixed = np.zeros(len(points), bool)
    points = relax(shape, points, triangles, None, fixed, fixed)
    return outlined(shape, points, triangles, regions)
