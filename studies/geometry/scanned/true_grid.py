"""The one true shape of a scan: the same level function for every mesh of it, with the volume of its surface."""

import numpy as np

from studies.geometry.mesh.organ_mesh import signed_volume
from studies.geometry.scanned.distance_grid import box_of, distance_grid
from studies.geometry.scanned.fidelity import TOLD
from studies.geometry.scanned.level_grid import DistanceGrid, shape_of
from studies.geometry.scanned.scan_shape import COARSEST, FINER, FINEST, ROOM, Surface, scan_surface
from studies.geometry.surface.family import enclosed_volume
from studies.geometry.surface.node_count import handles_of


def true_grid(points: np.ndarray, triangles: np.ndarray, name: str) -> DistanceGrid:
    """Signed distance to the closed outward surface points (n, 3) [m], triangles (t, 3), shifted by the constant, far
    below a cell, that gives the shape the volume of the surface.

    The cells are as fine as can be without more handles than the coarsest have: those are holes of the grid in parts
    too thin for it. Raises StudyError when nothing of the shape is left on the grid.
    """
    diagonal, _ = box_of(points, triangles)
    coarse = on_cells(points, triangles, COARSEST * diagonal)
    handles, cell = handles_of(*scan_surface(shape_of(coarse, name))), FINEST * diagonal
    while cell < COARSEST * diagonal:
        grid = on_cells(points, triangles, cell)
        start = scan_surface(shape_of(grid, name))
        if handles_of(*start) <= handles:
            return with_volume_of((points, triangles), grid, start, name)
        cell *= FINER
    return with_volume_of((points, triangles), coarse, scan_surface(shape_of(coarse, name)), name)


def on_cells(points: np.ndarray, triangles: np.ndarray, cell: float) -> DistanceGrid:
    """Signed distance on cells of edge `cell` [m]."""
    return distance_grid(points, triangles, cell, ROOM * cell)


def with_volume_of(surface: Surface, grid: DistanceGrid, start: Surface, name: str) -> DistanceGrid:
    """The grid shifted by a constant, so that its shape has the volume of the surface; start: a triangulation of it."""
    seen = enclosed_volume(shape_of(grid, name), 1)
    _, area = box_of(*start)
    return DistanceGrid(grid.low, grid.cell, grid.values - (wanted_volume(surface, seen) - seen) / area)


def wanted_volume(source: Surface, seen: float) -> float:
    """Volume [m^3] of the surface of which a shape is a picture; that of the shape, `seen`, where parts of the surface
    overlap or are lost."""
    said = signed_volume(*source)
    return said if abs(seen / said - 1.0) < TOLD else seen
