"""Makes the mesh of a scan, or its true shape, from a recipe in the worker process."""

import json
import sys
from dataclasses import replace
from typing import Any

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import Surface, signed_volume, triangle_areas
from studies.geometry.mesher.organ_recipe import finish
from studies.geometry.mesher.organ_surface import MOST_SPARE, EvenRemesher
from studies.geometry.mesher.process import Arrays, stage, work
from studies.geometry.scanned.distance_grid import box_of
from studies.geometry.scanned.fidelity import NOTABLE, fidelity
from studies.geometry.scanned.level_grid import grid_from, shape_of
from studies.geometry.scanned.scan_shape import (
    COARSEST,
    cell_for,
    faithful,
    levelled,
    scan_surface,
    solidified,
    target_volume,
    true_grid,
)
from studies.geometry.shape.levelset import Shape
from studies.geometry.shape.regions import Region, region_from_dict
from studies.geometry.surface.first_surface import enclosed_volume
from studies.geometry.surface.fit import Fit, fitted
from studies.geometry.surface.node_count import FEWEST, MOST, handles_of, surface_with
from studies.geometry.surface.volume import with_volume


def build(recipe: dict[str, Any], arrays: Arrays) -> Arrays:
    """The arrays for a recipe of kind "scan" (jobs.PARTS and losses) or "level" (jobs.LEVEL). Raises StudyError."""
    return {"scan": build_scan, "level": build_level}[recipe["kind"]](recipe, arrays)


def build_scan(recipe: dict[str, Any], arrays: Arrays) -> Arrays:
    """A mesh of the shape that a given surface approximates, with `nodes` surface nodes and the outlines of regions.

    It has the volume of the surface, and `losses` are its deviations from the file. If the arrays contain the grid of
    the true shape, the nodes lie on that shape instead, for sides that will be curved onto it, and the losses are the
    shape's.
    """
    file = arrays["points"], arrays["triangles"]
    regions = [region_from_dict(data) for data in recipe["regions"].values()]
    body = solid_body(recipe, file)
    if "values" in arrays:
        shape = shape_of(grid_from(arrays), recipe["name"])
        points, triangles = scan_mesh(shape, scan_surface(shape), recipe["nodes"], regions, curved=True)
    else:
        cell = cell_for(*body, recipe["nodes"])
        source = smooth_body(recipe, body, cell)
        grid, start = faithful(*source, cell, recipe["name"])
        shape = shape_of(grid, recipe["name"])
        points, triangles = scan_mesh(shape, start, recipe["nodes"], regions, curved=False)
        volume = signed_volume(*source)
        # This takes a second on a fine grid, so it runs only if the volume of the first triangulation is off.
        if abs(signed_volume(*start) / volume - 1.0) > 0.5 * NOTABLE:
            volume = target_volume(source, enclosed_volume(shape, 1))
        points = with_volume(points, triangles, volume, shape.level, regions)
    made = finish(replace(shape, wall=recipe.get("wall")), points, triangles, recipe)
    losses = arrays["losses"] if "losses" in arrays else lost(file, body, (points, triangles))
    return made | {"losses": losses}


def lost(file: Surface, body: Surface, made: Surface) -> np.ndarray:
    """The losses of a surface `made` from that of a `file`, as JSON; body: the surface whose volume counts."""
    stage("distances between mesh and file")
    return np.array(json.dumps(fidelity(file, made) | {"volume_file": signed_volume(*body)}))


def build_level(recipe: dict[str, Any], arrays: Arrays) -> Arrays:
    file = arrays["points"], arrays["triangles"]
    body = solid_body(recipe, file)
    grid = true_grid(*smooth_body(recipe, body, COARSEST * box_of(*body)[0]), recipe["name"])
    losses = lost(file, body, scan_surface(shape_of(grid, recipe["name"])))
    return {"low": grid.low, "cell": np.array(grid.cell), "values": grid.values, "losses": losses}


def solid_body(recipe: dict[str, Any], file: Surface) -> Surface:
    stage("distances to the surface of the file")
    return file if recipe.get("solid") is None else solidified(*file, recipe["solid"], recipe["name"])


def smooth_body(recipe: dict[str, Any], body: Surface, cell: float) -> Surface:
    """The surface, smoothed on a grid with cells of at most `cell` [m] if the recipe says so."""
    smooth = recipe["smooth"]
    return levelled(*body, cell, smooth, recipe["name"]) if smooth > 0 else body


NEARNESS = (0.2, 0.1, 0.3)
"""Largest distances of the remesher from the surface, over the edge length, tried in turn: it is unpredictable which
one is best for a thin margin."""
SPARE = 0.1
"""Share of the nodes that go where the mesh of the evenly spread ones is farthest from its shape."""


def scan_mesh(shape: Shape, start: Surface, nodes: int, regions: list[Region], curved: bool) -> Surface:
    """A surface of `nodes` nodes on f = 0 that follows its shape, with the outline of every region on its edges. start:
    a fine triangulation of the shape; curved: the sides will be quadratic, with mid-side nodes on f = 0. Raises
    StudyError if none is well shaped."""
    area, handles = float(triangle_areas(*start).sum()), handles_of(*start)
    best: Fit | None = None
    refusals = []
    for nearness in NEARNESS:
        stage(f"a surface of {nodes} nodes, try {NEARNESS.index(nearness) + 1} of {len(NEARNESS)}")
        mesh_at = EvenRemesher(*start, nearness).mesh
        try:
            spare = min(round(SPARE * nodes), MOST_SPARE)
            count = max(FEWEST, nodes - spare) if FEWEST <= nodes <= MOST else nodes  # refused by surface_with
            base = surface_with(count, area, mesh_at, shape, handles)
            made = fitted(shape, base, nodes, regions, start, curved)
        except StudyError as error:
            refusals.append(error)
            continue
        if best is None or made.badness() < best.badness():
            best = made
        if best.badness() <= 1.0:
            break
    if best is None:
        raise refusals[0]
    return best.surface


if __name__ == "__main__":
    sys.exit(work(build, *sys.argv[1:4]))
