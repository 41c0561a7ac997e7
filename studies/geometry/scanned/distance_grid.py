"""The signed distance to a closed triangulation on a regular grid: the basis for smoothing, closing and remeshing a
scan."""

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.optimize import root_scalar

from studies.geometry.mesh.organ_mesh import triangle_areas
from studies.geometry.scanned.level_grid import DistanceGrid
from studies.geometry.surface.triangle_distance import band_distance_into, far_distance_into

WALL_CELLS = 100
"""Cells along the diagonal on which the thickness of a wall is found, to about 1 %."""
BAND = 4.0
"""Distance in cells up to which the grid is exact; farther out it is accurate to a few per cent of a cell."""


def distance_grid(points: np.ndarray, triangles: np.ndarray, cell: float, margin: float) -> DistanceGrid:
    """Signed distance [m], negative inside, to a surface of points (n, 3) [m] and outward triangles (t, 3) without
    border, on cells of edge `cell` [m] with `margin` [m] around it. A point lies inside if its winding number is
    positive, so parts that overlap or cross themselves count once."""
    used = points[np.unique(triangles)]
    low, high = used.min(axis=0) - margin, used.max(axis=0) + margin
    shape = np.ceil((high - low) / cell).astype(int) + 1
    axes = [low[k] + cell * np.arange(shape[k]) for k in range(3)]
    inside = winding_number(points, triangles, axes) > 0
    squared = squared_distance((points[triangles] - low) / cell, tuple(shape))
    return DistanceGrid(low, cell, np.where(inside, -cell, cell) * np.sqrt(squared))


def even_wall(points: np.ndarray, triangles: np.ndarray, lumen: float) -> float:
    """Thickness [m] of the even wall inside a closed outward surface that leaves a lumen of this volume [m³]."""
    cell = box_of(points, triangles)[0] / WALL_CELLS
    grid = distance_grid(points, triangles, cell, 2.0 * cell)

    def excess(wall: float) -> float:
        return DistanceGrid(grid.low, cell, grid.values + wall).volume - lumen

    return float(root_scalar(excess, bracket=(0.0, -float(grid.values.min()) + cell), xtol=1e-6 * cell).root)


def squared_distance(corners: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Squared distance [cells^2] of the points of a grid of `shape` to triangles with corners (t, 3, 3) [cells]: exact
    up to a distance of BAND, farther out to one triangle, the nearest of the nearest grid point within one cell of the
    surface."""
    squared, owner, scratch = np.full(shape, np.inf), np.zeros(shape, np.uint32), np.empty((4, 3))
    band_distance_into(corners, BAND, scratch, squared, owner)
    # One cell is enough: every point of the surface is within half the diagonal of a cell, 0.87, of a grid point.
    nearest = distance_transform_edt(squared > 1.0, return_distances=False, return_indices=True)
    far_distance_into(corners, BAND, owner[tuple(np.asarray(nearest))], scratch, squared)
    return squared


def winding_number(points: np.ndarray, triangles: np.ndarray, axes: list[np.ndarray]) -> np.ndarray:
    """Winding number of the surface around each grid point, shape (a, b, c): signed crossings of the ray upwards.

    axes: coordinates [m] of the grid along x, y, z. Rays are moved off the grid by a tiny irrational fraction of a
    cell, so that none meets an edge. Each edge is evaluated from its lower to its higher node, so its two triangles
    agree.
    """
    x, y, z = axes
    shift = 1e-7 * (x[1] - x[0]) * np.array([np.sqrt(2.0), np.sqrt(3.0)])
    flat = points[:, :2] - np.array([x[0], y[0]]) - shift
    triangle, i, j = columns_under(flat[triangles] / (x[1] - x[0]), (len(x), len(y)))
    ray = np.stack([i, j], axis=1) * (x[1] - x[0])
    corners = triangles[triangle]
    weights = [edge_function(flat, corners[:, k - 2], corners[:, k - 1], ray) for k in range(3)]
    side = np.sign(weights[0])
    hit = (side != 0) & (np.sign(weights[1]) == side) & (np.sign(weights[2]) == side)
    total = np.where(hit, sum(weights), 1.0)
    height = sum(w * points[corners[:, k], 2] for k, w in enumerate(weights)) / total
    counts = np.zeros((len(x), len(y), len(z) + 1))
    # A ray upwards leaves the body through a face that looks up, so the face adds 1 for all grid points below it.
    level = np.searchsorted(z, height[hit])
    np.add.at(counts, (i[hit], j[hit], level), side[hit])
    return counts[:, :, ::-1].cumsum(axis=2)[:, :, ::-1][:, :, 1:]


def columns_under(corners: np.ndarray, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangle and column i, j of all columns of a grid of `shape` in the box of each triangle, each (m,); corners: of
    the triangles in the xy plane, (t, 3, 2) [cells]."""
    first = np.clip(np.ceil(corners.min(axis=1)), 0, None).astype(int)
    last = np.clip(np.floor(corners.max(axis=1)), None, np.array(shape) - 1).astype(int)
    size = np.maximum(last - first + 1, 0)
    count = size.prod(axis=1)
    triangle = np.repeat(np.arange(len(corners)), count)
    within = np.arange(len(triangle)) - np.repeat(count.cumsum() - count, count)
    i, j = np.divmod(within, np.maximum(size[triangle, 1], 1))
    return triangle, first[triangle, 0] + i, first[triangle, 1] + j


def edge_function(flat: np.ndarray, start: np.ndarray, end: np.ndarray, ray: np.ndarray) -> np.ndarray:
    """Twice the signed area of (start, end, ray) in the plane, (n,); the reverse edge has exactly its negative. flat:
    points (m, 2); start, end: node numbers (n,); ray: points (n, 2)."""
    turned = start > end
    a, b = flat[np.where(turned, end, start)], flat[np.where(turned, start, end)]
    area = (b[:, 0] - a[:, 0]) * (ray[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (ray[:, 0] - a[:, 0])
    return np.where(turned, -area, area)


def box_of(points: np.ndarray, triangles: np.ndarray) -> tuple[float, float]:
    """Diagonal of the bounding box [m] and area [m^2] of a surface."""
    diagonal = float(np.linalg.norm(np.ptp(points[np.unique(triangles)], axis=0)))
    return diagonal, float(triangle_areas(points, triangles).sum())
