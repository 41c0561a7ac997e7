"""Making a mesh from its recipe, inside the worker process. The same recipe gives the same mesh bit for bit."""

import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.checks import check_surface
from studies.geometry.mesh.organ_mesh import triangle_areas
from studies.geometry.mesh.wall_layers import fill_wall
from studies.geometry.mesher.fill import fill_surface
from studies.geometry.mesher.gmsh_calls import Remesher, fresh_model
from studies.geometry.mesher.mmg_calls import EvenRemesher
from studies.geometry.mesher.octant import build_octant
from studies.geometry.mesher.progress import stage
from studies.geometry.mesher.worker import Arrays, work
from studies.geometry.organs.make_shape import make_shape
from studies.geometry.shape.levelset import Shape, at_depth
from studies.geometry.shape.regions import ON_CURVE, Region, region_from_dict
from studies.geometry.surface.family import enclosed_volume
from studies.geometry.surface.first_surface import first_surface
from studies.geometry.surface.intersections import crossing_triangles
from studies.geometry.surface.node_count import Surface, surface_with
from studies.geometry.surface.snap import relax, snap_region
from studies.geometry.surface.volume import with_volume

NEARNESS = 0.2
"""Distance to the first triangulation, over the size, that MMG keeps to."""


def build(recipe: dict[str, Any], arrays: Arrays) -> Arrays:
    """The arrays of jobs.PARTS for a recipe; `arrays` holds a given surface for kind "fill".

    Raises StudyError when the recipe cannot be made.
    """
    return {"organ": build_organ, "fill": build_fill, "ball_octant": build_octant}[recipe["kind"]](recipe, arrays)


def build_organ(recipe: dict[str, Any], arrays: Arrays) -> Arrays:
    """An organ of SHAPES with `nodes` surface nodes, its outlines of regions snapped, filled when asked."""
    return mesh_shape(make_shape(recipe["organ"], recipe["parameters"]), recipe)


def mesh_shape(shape: Shape, recipe: dict[str, Any]) -> Arrays:
    """Any shape by the `nodes`, `regions`, `fill` and `layers` of a recipe; hollow when the shape has a wall."""
    regions = [region_from_dict(data) for data in recipe["regions"].values()]
    points, triangles = mesh_surface(shape, recipe["nodes"], regions)
    if has_exact_volume(recipe):
        points = with_volume(points, triangles, enclosed_volume(shape, 2), shape.level, regions)
    return finish(shape, points, triangles, recipe)


def finish(shape: Shape, points: np.ndarray, triangles: np.ndarray, recipe: dict[str, Any]) -> Arrays:
    """A surface on f = 0, filled as its recipe says; elements of a scan are as good as its folds allow."""
    check_surface(points, triangles, shape.name)
    stage("filling")
    if not recipe["fill"]:
        return arrays_of(points, triangles, np.empty((0, 4), np.int64), len(points), len(points))
    if shape.wall is not None:
        made = fill_wall(shape, points, triangles, recipe.get("layers"))
        all_points = with_lumen_volume(shape, made[0], triangles) if has_exact_volume(recipe) else made[0]
        return arrays_of(all_points, *made[1:], 2 * len(points), len(points))
    all_points, tetrahedra = fill_surface(points, triangles, strict=recipe["kind"] != "scan")
    return arrays_of(all_points, triangles, tetrahedra, len(points), len(points))


def has_exact_volume(recipe: dict[str, Any]) -> bool:
    """Whether the mesh has the volume of its shape, its nodes a little off it: of a scan, or of an organ on wish."""
    return recipe["kind"] == "scan" or recipe.get("exact", False)


def with_lumen_volume(shape: Shape, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Points (n, 3) [m] of a wall whose lumen, behind the outer `triangles` (t, 3), has its true volume."""
    count, inner = int(triangles.max()) + 1, at_depth(shape, shape.wall or 0.0)
    points = points.copy()
    lumen = points[count : 2 * count]
    points[count : 2 * count] = with_volume(lumen, triangles, enclosed_volume(inner, 1), inner.level)
    return points


def mesh_surface(shape: Shape, nodes: int, regions: list[Region]) -> Surface:
    """An even surface with `nodes` nodes and every region's outline on its edges.

    Where edges are too long for a region, the surface is meshed again with edges half as long in the regions.
    """
    stage(f"a surface of {nodes} nodes")
    start_points, start_triangles = first_surface(shape)
    area = float(triangle_areas(start_points, start_triangles).sum())
    for region in regions:
        region.level(start_points[:1])  # a region that is none is refused here, not inside the mesher
    with fresh_model():
        remesher = Remesher(start_points, start_triangles)
        start = start_points, start_triangles
        surface = snap_if_it_fits(shape, *well_shaped(shape, start, nodes, area, remesher.mesh), regions)
        if surface is None:
            remesher.finer_in(regions)
            surface = snap_all(shape, *surface_with(nodes, area, remesher.mesh, shape), regions)
    return surface


def well_shaped(shape: Shape, start: Surface, nodes: int, area: float, mesh_at: Callable[[float], Surface]) -> Surface:
    """An even surface of `nodes` nodes by `mesh_at`; where it makes none, by MMG from the first triangulation."""
    try:
        return surface_with(nodes, area, mesh_at, shape)
    except StudyError:
        # Not lost: MMG makes one, or gives a sentence of the same kind.
        return surface_with(nodes, area, EvenRemesher(*start, NEARNESS).mesh, shape)


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


def outlined(
    shape: Shape, points: np.ndarray, triangles: np.ndarray, regions: list[Region], near: float = np.inf
) -> Surface:
    """The surface with every region's outline on its edges; earlier outlines stay where they are, and so does what is
    farther from an outline than `near` [m]."""
    fixed = np.zeros(len(points), bool)
    for region in regions:
        far = np.abs(region.level(points)) > near
        points, triangles, on_curve = snap_region(shape, points, triangles, region, fixed | far)
        fixed |= on_curve
    return points, triangles


def build_fill(recipe: dict[str, Any], arrays: Arrays) -> Arrays:
    """A given surface, filled as well as its triangles allow."""
    points, triangles = arrays["points"], arrays["triangles"]
    crossing = len(crossing_triangles(points, triangles))
    if crossing:
        raise StudyError(
            f"{recipe['name']}: {crossing} pairs of triangles cut through each other, so the surface could not be "
            "filled; make a new one (organbench mesh --from FILE --nodes 550)"
        )
    stage("filling")
    all_points, tetrahedra = fill_surface(points, triangles, strict=False)
    return arrays_of(all_points, triangles, tetrahedra, len(points), len(points))


def arrays_of(
    points: np.ndarray, triangles: np.ndarray, tetrahedra: np.ndarray, surface_count: int, outer_count: int
) -> Arrays:
    """What the worker hands over, by the names of jobs.PARTS."""
    counts = {"surface_count": np.array(surface_count), "outer_count": np.array(outer_count)}
    return {"points": points, "triangles": triangles, "tetrahedra": tetrahedra, **counts}


if __name__ == "__main__":
    sys.exit(work(build, *sys.argv[1:4]))
