"""The one true shape of a scan: the same level function for every mesh of it, with the volume of its surface."""

import numpy as np

from studies.geometry.mesh.organ_mesh import signed_volume
from studies.geometry.scanned.distance_grid import box_of
from studies.geometry.scanned.fidelity import NOTABLE
from studies.geometry.scanned.level_grid import DistanceGrid, shape_of
from studies.geometry.scanned.scan_shape import COARSEST, Surface, faithful
from studies.geometry.surface.family import enclosed_volume

NEAR = 0.002
"""Distance over the diagonal that the shape may miss of the surface: a tenth of the limit of the warning."""


def true_grid(points: np.ndarray, triangles: np.ndarray, name: str) -> DistanceGrid:
    """Signed distance to the closed outward surface points (n, 3) [m], triangles (t, 3), shifted by the constant, far
    below a cell, that gives the shape the volume of the surface.

    Raises StudyError when nothing of the shape is left on the grid.
    """
    cell = COARSEST * box_of(points, triangles)[0]
    return with_volume_of((points, triangles), *faithful(points, triangles, cell, name, NEAR), name)


def with_volume_of(surface: Surface, grid: DistanceGrid, start: Surface, name: str) -> DistanceGrid:
    """The grid shifted by a constant, so that its shape has the volume of the surface; start: a triangulation of it."""
    volume = enclosed_volume(shape_of(grid, name), 1)
    _, area = box_of(*start)
    return DistanceGrid(grid.low, grid.cell, grid.values - (target_volume(surface, volume) - volume) / area)


def target_volume(source: Surface, shape_volume: float) -> float:
    """Volume [m^3] of the surface of which a shape is a picture; that of the shape, `shape_volume`, where parts
    of the surface overlap or are lost."""
    volume = signed_volume(*source)
    return volume if abs(shape_volume / volume - 1.0) < NOTABLE else shape_volume
