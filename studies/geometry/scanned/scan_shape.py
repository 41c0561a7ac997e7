"""A scan as a level set: from there the same way to a mesh as a synthetic organ's."""

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.optimize import root_scalar
from skimage.measure import marching_cubes

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import signed_volume, unique_edges
from studies.geometry.scanned.distance_grid import DistanceGrid, box_of, distance_grid
from studies.geometry.shape.levelset import Shape
from studies.geometry.surface.first_surface import first_surface
from studies.geometry.surface.repair import largest_part

COARSEST, FINEST = 1 / 40, 1 / 160
"""Cells of the grid over the diagonal of the box: enough for the thin parts of an organ, and at most 20 s of work."""
CELLS_PER_EDGE = 2.5
"""Cells along an edge of the wanted mesh, between these limits."""
ROOM = 4
"""Cells between the surface and the walls of the grid: the mesher's steps stay inside."""

Surface = tuple[np.ndarray, np.ndarray]


def scan_shape(points: np.ndarray, triangles: np.ndarray, nodes: int, smooth: float = 0.0, name: str = "scan") -> Shape:
    """The shape of which the closed outward triangulation points (n, 3) [m], triangles (t, 3) is a picture.

    nodes: of the mesh that is wanted, which decides the grid. smooth: length [m]; folds narrower than twice as much are
    closed (Serra's morphological closing: out by that length and back in) and finer bumps are levelled (a Gaussian of
    half that length on the signed distance), the volume after closing being kept; 0: only the facets of the file are
    rounded, within a cell. Raises StudyError when nothing of the shape is left on the grid.
    """
    diagonal, area = box_of(points, triangles)
    edge = np.sqrt(4.0 / np.sqrt(3.0) * area / (2.0 * nodes))
    cell = float(np.clip(edge / CELLS_PER_EDGE, FINEST * diagonal, COARSEST * diagonal))
    if smooth > 0:
        if smooth >= 0.25 * diagonal:
            raise StudyError(
                f"{name}: smoothing over {1e3 * smooth:.3g} mm would leave nothing of a body of "
                f"{1e3 * diagonal:.3g} mm; use a few millimetres"
            )
        fine = min(cell, max(smooth / 2.0, FINEST * diagonal))
        points, triangles = smoothed(points, triangles, fine, smooth, name)
    grid = distance_grid(points, triangles, cell, ROOM * cell)
    low, high = tuple(map(float, grid.low)), tuple(map(float, grid.high))
    return Shape(name, grid.level(), low, high, cell=cell)  # pyright: ignore[reportArgumentType]


def scan_surface(shape: Shape) -> Surface:
    """The first triangulation of a scan: its largest part, without what broke off in parts thinner than a cell.

    Raises StudyError when it has handles, on which the mesher would stall.
    """
    points, triangles = largest_part(*first_surface(shape))
    handles = 1 - (len(points) - len(unique_edges(triangles)) + len(triangles)) // 2
    if handles:
        raise StudyError(
            f"{shape.name}: the body has {handles} handles or tunnels, and only bodies without are remeshed; "
            "close narrow ones with --smooth, or keep the file's own triangles (no --nodes)"
        )
    return points, triangles


def smoothed(points: np.ndarray, triangles: np.ndarray, cell: float, smooth: float, name: str) -> Surface:
    """The surface after closing and levelling; see scan_shape."""
    room = smooth + ROOM * cell
    out = iso_surface(distance_grid(points, triangles, cell, room + smooth), smooth, name)
    back = iso_surface(distance_grid(*out, cell, room), -smooth, name)
    closed = distance_grid(*back, cell, room)
    values = gaussian_filter(closed.values, 0.5 * smooth / cell, mode="nearest")
    blurred = DistanceGrid(closed.low, cell, values)

    def excess(shift: float) -> float:
        return DistanceGrid(closed.low, cell, values - shift).volume - closed.volume

    shift = root_scalar(excess, bracket=(-smooth, smooth), xtol=1e-6 * cell).root
    return iso_surface(blurred, shift, name)


def iso_surface(grid: DistanceGrid, value: float, name: str) -> Surface:
    """The largest part of the surface where the distance is `value` [m], outward."""
    if not grid.values.min() < value < grid.values.max():
        raise StudyError(
            f"{name}: nothing of the body is left {1e3 * abs(value):.3g} mm inside its surface; smooth less"
        )
    corners, triangles, _, _ = marching_cubes(grid.values, value, spacing=(grid.cell,) * 3, allow_degenerate=False)
    points, triangles = corners.astype(float) + grid.low, triangles.astype(np.int64)
    if signed_volume(points, triangles) < 0:
        triangles = triangles[:, ::-1].copy()
    return largest_part(points, triangles)
