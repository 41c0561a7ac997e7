"""A scan as a level set, which is then meshed like a synthetic organ."""

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.optimize import root_scalar
from skimage.measure import marching_cubes

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import signed_volume
from studies.geometry.scanned.distance_grid import box_of, distance_grid
from studies.geometry.scanned.level_grid import DistanceGrid, shape_of
from studies.geometry.shape.levelset import Shape
from studies.geometry.surface.distance import distance_to_surface
from studies.geometry.surface.first_surface import first_surface
from studies.geometry.surface.node_count import handles_of
from studies.geometry.surface.repair import largest_part

COARSEST, FINEST = 1 / 40, 1 / 160
"""Limits of the cell edge over the diagonal of the box: fine enough for the thin parts of an organ, coarse enough for
at most 20 s of work."""
CELLS_PER_EDGE = 2.5
"""Cells along an edge of the mesh, within these limits."""
MISSED, FINER = 0.01, 1.6
"""Distance over the diagonal beyond which the grid is refined, half of fidelity.NOTABLE; and the factor by which the
cells then shrink."""
ASKED = 5000
"""Most nodes of the file at which this distance is measured."""
ROOM = 4
"""Cells between the surface and the walls of the grid, so that the steps of the mesher stay inside."""

Surface = tuple[np.ndarray, np.ndarray]


def scan_shape(points: np.ndarray, triangles: np.ndarray, nodes: int, smooth: float = 0.0, name: str = "scan") -> Shape:
    """The shape that a closed outward triangulation of points (n, 3) [m] and triangles (t, 3) approximates.

    nodes: of the mesh to be made, which decides the grid. smooth [m]: as in `levelled`; 0: only the facets of the file
    are rounded, within a cell. Raises StudyError if smoothing leaves nothing of the shape.
    """
    cell = cell_for(points, triangles, nodes)
    if smooth > 0:
        points, triangles = levelled(points, triangles, cell, smooth, name)
    return shape_of(grid_on(points, triangles, cell), name)


def cell_for(points: np.ndarray, triangles: np.ndarray, nodes: int) -> float:
    """Edge [m] of the grid cells for a mesh of so many nodes."""
    diagonal, area = box_of(points, triangles)
    edge = np.sqrt(4.0 / np.sqrt(3.0) * area / (2.0 * nodes))
    return float(np.clip(edge / CELLS_PER_EDGE, FINEST * diagonal, COARSEST * diagonal))


def levelled(points: np.ndarray, triangles: np.ndarray, cell: float, smooth: float, name: str) -> Surface:
    """The surface without details finer than the length `smooth` [m].

    Folds narrower than twice `smooth` are closed by Serra's morphological closing: the surface moves out by `smooth`
    and back in. Then a Gaussian of half that length on the signed distance levels bumps, and the volume after closing
    is kept. cell: largest cell edge [m]. Raises StudyError if nothing of the shape is left.
    """
    diagonal, _ = box_of(points, triangles)
    if smooth >= 0.25 * diagonal:
        raise StudyError(
            f"{name}: smoothing over {1e3 * smooth:.3g} mm would leave nothing of a body of "
            f"{1e3 * diagonal:.3g} mm; use a few millimetres"
        )
    return smoothed(points, triangles, min(cell, max(smooth / 2.0, FINEST * diagonal)), smooth, name)


def grid_on(points: np.ndarray, triangles: np.ndarray, cell: float) -> DistanceGrid:
    """The signed distance to the surface on a grid of cells of edge `cell` [m]."""
    return distance_grid(points, triangles, cell, ROOM * cell)


def faithful(
    points: np.ndarray, triangles: np.ndarray, cell: float, name: str, allowed: float = MISSED
) -> tuple[DistanceGrid, Surface]:
    """The signed distance to a surface and its first triangulation, on a grid fine enough for its thin parts.

    The cells start at `cell` [m] and shrink, down to FINEST of the diagonal, as long as the surface is farther than
    `allowed` of the diagonal from the triangulation. A finer grid with more handles is not used: the handles are holes
    in parts that are too thin for it.
    """
    diagonal, _ = box_of(points, triangles)
    grid = grid_on(points, triangles, cell)
    start = scan_surface(shape_of(grid, name))
    while cell > 1.01 * FINEST * diagonal and missed(points, triangles, start) > allowed * diagonal:
        cell = max(cell / FINER, FINEST * diagonal)
        finer = grid_on(points, triangles, cell)
        fine = scan_surface(shape_of(finer, name))
        if handles_of(*fine) <= handles_of(*start):
            grid, start = finer, fine
    return grid, start


def missed(points: np.ndarray, triangles: np.ndarray, start: Surface) -> float:
    """Largest distance [m] of the nodes of a surface from a triangulation of it, measured at ASKED nodes at most."""
    used = np.unique(triangles)
    return float(distance_to_surface(points[used[:: -(-len(used) // ASKED)]], *start).max())


def scan_surface(shape: Shape) -> Surface:
    """The first triangulation of a scan, reduced to its largest part: parts thinner than a cell leave fragments."""
    return largest_part(*first_surface(shape))


def smoothed(points: np.ndarray, triangles: np.ndarray, cell: float, smooth: float, name: str) -> Surface:
    """The surface after closing and levelling on cells of edge `cell` [m]; see `levelled`."""
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
    """The largest part of the surface where the distance is `value` [m], with outward triangles.

    Raises StudyError if no distance of the grid is below the value, or none above it.
    """
    if not grid.values.min() < value < grid.values.max():
        raise StudyError(
            f"{name}: nothing of the body is left {1e3 * abs(value):.3g} mm inside its surface; smooth less"
        )
    corners, triangles, _, _ = marching_cubes(grid.values, value, spacing=(grid.cell,) * 3, allow_degenerate=False)
    points, triangles = corners.astype(float) + grid.low, triangles.astype(np.int64)
    if signed_volume(points, triangles) < 0:
        triangles = triangles[:, ::-1].copy()
    return largest_part(points, triangles)
