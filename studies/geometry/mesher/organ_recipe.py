"""Makes a mesh from its recipe in the worker process. The same recipe gives the same mesh bit for bit."""

import sys
from typing import Any

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.checks import check_surface
from studies.geometry.mesh.wall_layers import fill_wall
from studies.geometry.mesher.gmsh_calls import build_octant, fill_surface
from studies.geometry.mesher.jobs import cuts_of
from studies.geometry.mesher.organ_surface import organ_surface
from studies.geometry.mesher.process import Arrays, stage, work
from studies.geometry.mesher.section import check_clear, cut_wall, fill_cut, plane_of, with_front
from studies.geometry.organs import make_shape
from studies.geometry.shape.levelset import Shape, at_depth
from studies.geometry.shape.regions import region_from_dict
from studies.geometry.surface.first_surface import enclosed_volume
from studies.geometry.surface.intersections import crossing_triangles
from studies.geometry.surface.volume import with_volume


def build(recipe: dict[str, Any], arrays: Arrays) -> Arrays:
    """The arrays of jobs.PARTS for a recipe of kind "organ", "fill" or "ball_octant". arrays: points and triangles of
    the surface to fill; for kind "organ" that of the same recipe without "fill", or nothing. Raises StudyError."""
    return {"organ": build_organ, "fill": build_fill, "ball_octant": build_octant}[recipe["kind"]](recipe, arrays)


def build_organ(recipe: dict[str, Any], arrays: Arrays) -> Arrays:
    """An organ of SHAPES by the `nodes`, `regions`, `sides`, `exact`, cuts, `fill` and `layers` of a recipe.

    With sides "straight" or "curved" nodes are placed so that sides of this kind follow the shape; without, they are
    evenly spread.
    """
    shape = make_shape(recipe["organ"], recipe["parameters"])
    if arrays:
        return finish(shape, arrays["points"], arrays["triangles"], recipe)
    held = [region_from_dict(data) for data in recipe["regions"].values()]
    cuts = list(cuts_of(recipe).values())
    regions = held + [plane_of(cut) for cut in cuts]
    check_clear(shape, cuts, held, recipe["nodes"])
    points, triangles = organ_surface(shape, recipe["nodes"], regions, recipe.get("sides"))
    if has_exact_volume(recipe):
        points = with_volume(points, triangles, enclosed_volume(shape, 2), shape.level, regions)
    for cut in cuts:
        points, triangles = with_front(shape, (points, triangles), cut)
    return finish(shape, points, triangles, recipe)


def finish(shape: Shape, points: np.ndarray, triangles: np.ndarray, recipe: dict[str, Any]) -> Arrays:
    """The arrays of a surface of the shape, filled if the recipe says so. For a scan elements of lower quality are
    accepted, because its folds may not allow better ones."""
    check_surface(points, triangles, shape.name)
    stage("filling")
    if not recipe["fill"]:
        return arrays_of(points, triangles, np.empty((0, 4), np.int64), len(points), len(points))
    cuts = cuts_of(recipe)
    if shape.wall is not None:
        made = fill_wall(shape, points, triangles, recipe.get("layers"))
        all_points = made[0]
        if has_exact_volume(recipe):
            lumen, inner = slice(len(points), 2 * len(points)), at_depth(shape, shape.wall)
            volume = enclosed_volume(inner, 1)
            all_points[lumen] = with_volume(all_points[lumen], triangles, volume, inner.level)
        faces = {}
        for part, cut in cuts.items():
            all_points, faces[part] = cut_wall(shape, all_points, triangles, made[2], cut)
        return arrays_of(all_points, *made[1:], 2 * len(points), len(points)) | faces
    if cuts:
        all_points, tetrahedra, faces = fill_cut(shape, (points, triangles), list(cuts.values()))
        made = arrays_of(all_points, triangles, tetrahedra, len(points), len(points))
        return made | dict(zip(cuts, faces, strict=True))
    all_points, tetrahedra = fill_surface(points, triangles, strict=recipe["kind"] != "scan")
    return arrays_of(all_points, triangles, tetrahedra, len(points), len(points))


def has_exact_volume(recipe: dict[str, Any]) -> bool:
    """Whether the mesh gets the volume of its shape, with nodes slightly off it: a scan, or an organ with `exact`."""
    return recipe["kind"] == "scan" or recipe.get("exact", False)


def build_fill(recipe: dict[str, Any], arrays: Arrays) -> Arrays:
    """A given surface, filled as well as its triangles allow. Raises StudyError if it intersects itself."""
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
    counts = {"surface_count": np.array(surface_count), "outer_count": np.array(outer_count)}
    return {"points": points, "triangles": triangles, "tetrahedra": tetrahedra, **counts}


if __name__ == "__main__":
    sys.exit(work(build, *sys.argv[1:4]))
