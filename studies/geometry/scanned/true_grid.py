"""The true shape of a scan: one level function for all its meshes, with the volume of its surface."""

import numpy as np

from studies.geometry.mesh.organ_mesh import signed_volume
from studies.geometry.scanned.distance_grid import box_of
from studies.geometry.scanned.fidelity import NOTABLE
from studies.geometry.scanned.level_grid import DistanceGrid, shape_of
from studies.geometry.scanned.scan_shape import COARSEST, Surface, faithful
from studies.geometry.surface.family import enclosed_volume

NEAR = 0.002
"""Largest distance over the diagonal between surface and shape: a tenth of fidelity.NOTABLE."""


def true_grid(points: np.ndarray, triangles: np.ndarray, name: str) -> DistanceGrid:
    """Signed distance to a closed outward surface of points (n, 3) [m] and triangles (t, 3), shifted by a constant.

    The constant is far below a cell and gives the shape the volume of `target_volume`, to first order. Raises
    StudyError if nothing of the shape is left on the grid.
    """
    cell = COARSEST * box_of(points, triangles)[0]
    return with_volume_of((points, triangles), *faithful(points, triangles, cell, name, NEAR), name)


def with_volume_of(surface: Surface, grid: DistanceGrid, start: Surface, name: str) -> DistanceGrid:
    """The grid shifted by a constant that gives its shape the `target_volume`; start: a triangulation of the shape."""
    volume = enclosed_volume(shape_of(grid, name), 1)
    _, area = box_of(*start)
    return DistanceGrid(grid.low, grid.cell, grid.values - (target_volume(surface, volume) - volume) / area)


def target_volume(source: Surface, shape_volume: float) -> float:
    """Volume [m^3] of the surface that a shape approximates, or `shape_volume` if the two differ by NOTABLE or more,
    because parts of the surface overlap or are lost."""
    volume = signed_volume(*source)
    return volume if abs(shape_volume / volume - 1.0) < NOTABLE else shape_volume
