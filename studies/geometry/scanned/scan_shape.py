"""A scan as a level set, which is then meshed like a synthetic organ: its grid, smoothed or filled if asked, and the
true shape, which is the same for all its meshes."""

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter, label
from scipy.optimize import root_scalar
from skimage.measure import marching_cubes

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import Surface, signed_volume
from studies.geometry.scanned.distance_grid import box_of, distance_grid, squared_distance
from studies.geometry.scanned.fidelity import NOTABLE
from studies.geometry.scanned.level_grid import DistanceGrid, shape_of
from studies.geometry.shape.levelset import Shape
from studies.geometry.surface.distance import distance_to_surface
from studies.geometry.surface.first_surface import enclosed_volume, first_surface
from studies.geometry.surface.node_count import handles_of
from studies.geometry.surface.repair import largest_part

COARSEST, FINEST = 1 / 40, 1 / 160
"""Limits of the cell edge over the diagonal of the box: fine enough for the thin parts of an organ, coarse enough for
at most 20 s of work."""
CELLS_PER_EDGE = 2.5
"""Cells along an edge of the mesh, within these limits."""
MISSED, FINER = 0.01, 1.6
"""Distance over the diagonal beyond which the grid is refined, half of NOTABLE; and the factor by which the
cells then shrink."""
ASKED = 5000
"""Most nodes of the file at which this distance is measured."""
ROOM = 4
"""Cells between the surface and the walls of the grid, so that the steps of the mesher stay inside."""
NEAR = 0.002
"""Largest distance over the diagonal between surface and shape: a tenth of NOTABLE."""
WIDEST = 0.5
"""Largest opening that is closed, over the size: the grid grows with its cube."""
TIGHT = 1.0
"""Smallest thickening of a wall in cells, which makes it tight on the grid."""
BLUNT = 0.7
"""Standard deviation of the Gaussian, in cells, that removes the steps of the cells."""


def cell_for(points: np.ndarray, triangles: np.ndarray, nodes: int) -> float:
    """Edge [m] of the grid cells for a mesh of so many nodes."""
    diagonal, area = box_of(points, triangles)
    edge = np.sqrt(4.0 / np.sqrt(3.0) * area / (2.0 * nodes))
    return float(np.clip(edge / CELLS_PER_EDGE, FINEST * diagonal, COARSEST * diagonal))


def levelled(points: np.ndarray, triangles: np.ndarray, cell: float, smooth: float, name: str) -> Surface:
    """The surface without details finer than the length `smooth` [m].

    Folds narrower than twice `smooth` are closed by Serra's morphological closing: the surface moves out by `smooth`
    and back in. Then a Gaussian of half that length levels bumps, and the volume after closing is kept. cell: largest
    cell edge [m]. Raises StudyError if nothing of the shape is left.
    """
    diagonal, _ = box_of(points, triangles)
    if smooth >= 0.25 * diagonal:
        raise StudyError(
            f"{name}: smoothing over {1e3 * smooth:.3g} mm would leave nothing of a body of "
            f"{1e3 * diagonal:.3g} mm; use a few millimetres"
        )
    cell = min(cell, max(smooth / 2.0, FINEST * diagonal))
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


def faithful(
    points: np.ndarray, triangles: np.ndarray, cell: float, name: str, allowed: float = MISSED
) -> tuple[DistanceGrid, Surface]:
    """The signed distance to a surface and its first triangulation, on a grid fine enough for its thin parts: cells
    shrink from `cell` [m] to FINEST of the diagonal as long as the surface is farther than `allowed` of it from the
    triangulation. A finer grid with more handles is not used: they are holes in parts that are too thin for it."""
    diagonal, _ = box_of(points, triangles)
    used = np.unique(triangles)
    asked = points[used[:: -(-len(used) // ASKED)]]
    grid = distance_grid(points, triangles, cell, ROOM * cell)
    start = scan_surface(shape_of(grid, name))
    while cell > 1.01 * FINEST * diagonal and distance_to_surface(asked, *start).max() > allowed * diagonal:
        cell = max(cell / FINER, FINEST * diagonal)
        finer = distance_grid(points, triangles, cell, ROOM * cell)
        fine = scan_surface(shape_of(finer, name))
        if handles_of(*fine) <= handles_of(*start):
            grid, start = finer, fine
    return grid, start


def scan_surface(shape: Shape) -> Surface:
    """The first triangulation of a scan, reduced to its largest part: parts thinner than a cell leave fragments."""
    return largest_part(*first_surface(shape))


def iso_surface(grid: DistanceGrid, value: float, name: str) -> Surface:
    """The largest part of the surface where the distance is `value` [m], with outward triangles. Raises StudyError if
    no distance of the grid is below the value, or none above it."""
    if not grid.values.min() < value < grid.values.max():
        raise StudyError(
            f"{name}: nothing of the body is left {1e3 * abs(value):.3g} mm inside its surface; smooth less"
        )
    corners, triangles, _, _ = marching_cubes(grid.values, value, spacing=(grid.cell,) * 3, allow_degenerate=False)
    points, triangles = corners.astype(float) + grid.low, triangles.astype(np.int64)
    if signed_volume(points, triangles) < 0:
        triangles = triangles[:, ::-1].copy()
    return largest_part(points, triangles)


def solidified(points: np.ndarray, triangles: np.ndarray, opening: float, name: str) -> Surface:
    """Outer surface of what triangles (t, 3) on points (n, 3) [m] enclose; openings up to `opening` [m] are closed.

    The triangles may be open, doubled or one-sided. They are thickened by half the opening or TIGHT cells; what is then
    reachable from outside is the outside, and grows back by the same amount. Raises StudyError if nothing is enclosed.
    """
    used = points[np.unique(triangles)]
    size = float(np.linalg.norm(np.ptp(used, axis=0)))
    if opening > WIDEST * size:
        raise StudyError(
            f"{name}: openings of {1e3 * opening:.3g} mm are wider than half of the body's size, {1e3 * size:.3g} mm; "
            "give a smaller --solid"
        )
    cell = FINEST * size
    reach = max(0.5 * opening, TIGHT * cell)
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
    return iso_surface(DistanceGrid(low, cell, gaussian_filter(values, BLUNT)), 0.0, name)


def true_grid(points: np.ndarray, triangles: np.ndarray, name: str) -> DistanceGrid:
    """Signed distance to a closed outward surface of points (n, 3) [m] and triangles (t, 3), shifted by a constant, far
    below a cell, that gives the shape the volume of `target_volume`, to first order. Raises StudyError if nothing of
    the shape is left on the grid."""
    cell = COARSEST * box_of(points, triangles)[0]
    grid, start = faithful(points, triangles, cell, name, NEAR)
    volume = enclosed_volume(shape_of(grid, name), 1)
    missing = target_volume((points, triangles), volume) - volume
    return DistanceGrid(grid.low, grid.cell, grid.values - missing / box_of(*start)[1])


def target_volume(source: Surface, shape_volume: float) -> float:
    """Volume [m^3] of the surface that a shape approximates, or `shape_volume` if the two differ by NOTABLE or more,
    because parts of the surface overlap or are lost."""
    volume = signed_volume(*source)
    return volume if abs(shape_volume / volume - 1.0) < NOTABLE else shape_volume
