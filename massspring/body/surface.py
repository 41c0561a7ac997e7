"""Checks that a list of triangles is a closed surface, and the winding number of a point."""

import numpy as np

from massspring.body.springs import EDGES_OF_TRIANGLE
from massspring.errors import MassSpringError
from massspring.kernels.forces.volume import enclosed_volume
from massspring.kernels.probe.point_query import winding_number_at


def winding_number(point: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> float:
    """How often a closed surface goes round `point` (3,): 1 inside, 0 outside, its solid angle over 4 pi.

    `points` (n, 3) [m], `triangles` (f, 3).
    """
    return float(winding_number_at(np.asarray(point, dtype=np.float64), points, triangles))


def check_finite(what: str, values: np.ndarray) -> None:
    """Raises MassSpringError naming `what` when a value is not finite."""
    if not np.isfinite(values).all():
        raise MassSpringError(
            f"{what} hold {int((~np.isfinite(values)).sum())} values that are not finite; repair the input"
        )


def checked_points(points: np.ndarray) -> np.ndarray:
    """Points (n, 3) [m] as float64, in C order. Raises MassSpringError for another shape, and unless they are real
    numbers."""
    array = np.asarray(points)
    if array.dtype.kind not in "fiu" or array.ndim != 2 or array.shape[1] != 3 or not len(array):
        raise MassSpringError(f"the points are {array.dtype} of shape {array.shape}; give real numbers (n, 3) [m]")
    return np.ascontiguousarray(array, dtype=np.float64)


def checked_indices(what: str, indices: np.ndarray, columns: int, count: int) -> np.ndarray:
    """Rows of `columns` node numbers, (k, columns), as uint32, in C order. Raises MassSpringError for another shape,
    and unless they are whole numbers from 0 to `count` - 1. what: their name, in the plural."""
    array = np.asarray(indices)
    if array.dtype.kind not in "iu" or array.ndim != 2 or array.shape[1] != columns:
        raise MassSpringError(
            f"the {what} are {array.dtype} of shape {array.shape}; give whole numbers of nodes, (k, {columns})"
        )
    wrong = array[(array < 0) | (array >= count)]
    if len(wrong):
        raise MassSpringError(f"the {what} name node {wrong[0]}, but nodes are numbered from 0 to {count - 1}")
    return np.ascontiguousarray(array, dtype=np.uint32)


def check_surface(points: np.ndarray, triangles: np.ndarray) -> None:
    """Raises MassSpringError unless the surface is closed, consistently oriented (every directed edge occurs once, and
    its reverse once) and outward (positive volume).

    `points` (n, 3) [m], `triangles` (f, 3), one sheet or several.
    """
    if len(triangles) < 4:
        raise MassSpringError(f"the surface has {len(triangles)} triangles; a closed one has at least 4")
    if int(triangles.max()) >= len(points):
        raise MassSpringError(f"a triangle names node {int(triangles.max())}, but there are {len(points)} nodes")
    edges = triangles[:, EDGES_OF_TRIANGLE].reshape(-1, 2).astype(np.int64)
    forward = edges[:, 0] * len(points) + edges[:, 1]
    backward = edges[:, 1] * len(points) + edges[:, 0]
    if len(np.unique(forward)) != len(forward):
        raise MassSpringError(
            "two triangles use an edge in the same direction; the surface is not manifold, or not consistently oriented"
        )
    lonely = np.setdiff1d(forward, backward)
    if len(lonely):
        raise MassSpringError(f"the surface is open at {len(lonely)} edges; close it, its volume is not defined")
    volume = enclosed_volume(points, triangles)
    if not volume > 0:
        raise MassSpringError(f"the surface encloses {volume:.3g} m³; it is flat or inverted; flip its triangles")
