"""The solid bodies that thin shells and open surfaces enclose: capsules, double walls, surfaces with holes."""

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter, label

from studies.base.errors import StudyError
from studies.geometry.scanned.distance_grid import DistanceGrid, squared_distance
from studies.geometry.scanned.scan_shape import FINEST, ROOM, Surface, iso_surface

LEAST = 1.0
"""Smallest thickening of a wall in cells, which makes it tight on the grid."""
ROUND = 0.7
"""Standard deviation of the Gaussian, in cells, that removes the steps of the cells."""


def solidified(points: np.ndarray, triangles: np.ndarray, opening: float, name: str) -> Surface:
    """Outer surface of what triangles (t, 3) on points (n, 3) [m] enclose; openings up to `opening` [m] are closed.

    The triangles may be open, doubled or one-sided. They are thickened by half the opening or LEAST cells. The region
    that is then reachable from outside is the outside, and it grows back by the same amount. Raises StudyError if
    nothing is enclosed.
    """
    used = points[np.unique(triangles)]
    cell = FINEST * float(np.linalg.norm(np.ptp(used, axis=0)))
    reach = max(0.5 * opening, LEAST * cell)
    margin = reach + ROOM * cell
    low = used.min(axis=0) - margin
    shape = np.ceil((used.max(axis=0) + margin - low) / cell).astype(int) + 1
    away = cell * np.sqrt(squared_distance((points[triangles] - low) / cell, tuple(shape)))
    regions = np.empty(away.shape, np.int32)
    label(away > reach, output=regions)
    inside = cell * np.asarray(distance_transform_edt(regions != regions[0, 0, 0])) > reach
    # The border lies between the last cell of one side and the first of the other, hence half a cell.
    steps = cell * (np.asarray(distance_transform_edt(inside)) + np.asarray(distance_transform_edt(~inside)) - 0.5)
    values = np.where(inside, -1.0, 1.0) * np.minimum(away, steps)
    if not inside.any() or not (away[inside] > 2 * cell).any():
        raise StudyError(
            f"{name}: the surface encloses nothing when openings up to {1e3 * opening:.3g} mm are closed; give a "
            "larger --solid, or leave it out"
        )
    return iso_surface(DistanceGrid(low, cell, gaussian_filter(values, ROUND)), 0.0, name)
