"""From a level function to a first closed triangulation, fine and smooth but with any number of nodes; and the volume
to which finer ones converge."""

import numpy as np
from skimage.measure import marching_cubes

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import signed_volume, unique_edges
from studies.geometry.shape.levelset import Shape, at_depth, project

SWEEPS = 8
"""Moves by 0.7 of the way to the mean of the neighbours, each followed by a projection to within 1 % of a cell; the
last projection is exact. Without them marching cubes leave slivers, and the parametrisation of gmsh hangs or crashes on
two shapes of three."""


def first_surface(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) [m] on f = 0 and outward triangles (t, 3), with edges about as long as `shape.cell`.

    Raises StudyError if f has no zero set in the box, or one that reaches its walls.
    """
    counts = [max(4, int(np.ceil((b - a) / shape.cell)) + 1) for a, b in zip(shape.low, shape.high, strict=True)]
    axes = [np.linspace(a, b, n) for a, b, n in zip(shape.low, shape.high, counts, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = shape.level(grid.reshape(-1, 3)).reshape(counts)
    walls = np.concatenate([values[[0, -1]].ravel(), values[:, [0, -1]].ravel(), values[:, :, [0, -1]].ravel()])
    if values.min() >= 0 or walls.min() <= 0:
        raise StudyError(
            f"{shape.name}: the surface is not inside its box ({shape.low} to {shape.high} m); correct the box"
        )
    spacing = tuple(float(axis[1] - axis[0]) for axis in axes)
    points, triangles, _, _ = marching_cubes(values, 0.0, spacing=spacing, allow_degenerate=False)
    points, triangles = points.astype(float) + shape.low, triangles.astype(np.int64)
    if signed_volume(points, triangles) < 0:
        triangles = triangles[:, ::-1].copy()
    edges = unique_edges(triangles)
    for _ in range(SWEEPS):
        points = project(shape, points + 0.7 * (neighbour_mean(points, edges) - points), within=0.01 * shape.cell)
    return project(shape, points), triangles


def neighbour_mean(points: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Mean position of the nodes that share an edge with each node, shape (n, 3)."""
    here, there = np.concatenate([edges, edges[:, ::-1]]).T
    count = np.bincount(here, minlength=len(points))
    total = np.stack([np.bincount(here, weights=points[there, k], minlength=len(points)) for k in range(3)], axis=1)
    return total / np.maximum(count, 1)[:, None]


def true_volume(shape: Shape, refinements: int = 2) -> float:
    """Volume [m^3] of the tissue of a shape, without its lumen, to about 1e-6 of it; see `enclosed_volume`."""
    outer = enclosed_volume(shape, refinements)
    return outer if shape.wall is None else outer - enclosed_volume(at_depth(shape, shape.wall), refinements)


def enclosed_volume(shape: Shape, refinements: int) -> float:
    """Volume [m^3] inside f = 0: triangles of a fine triangulation are quartered `refinements` times, with nodes on the
    true surface; Romberg's scheme extrapolates the volume, a series in the squared edge. Raises StudyError if the
    surface is not inside its box."""
    points, triangles = first_surface(shape)
    row = [signed_volume(points, triangles)]
    for _ in range(refinements):
        points, triangles = quartered(shape, points, triangles)
        new = [signed_volume(points, triangles)]
        for k, before in enumerate(row):
            new.append(new[-1] + (new[-1] - before) / (4.0 ** (k + 1) - 1.0))
        row = new
    return row[-1]


def quartered(shape: Shape, points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The triangulation with every triangle divided into four by new nodes on f = 0 at the middles of its edges."""
    count = len(points)
    edges = unique_edges(triangles)
    key = edges @ [count, 1]
    a, b, c = triangles.T
    ab, bc, ca = (
        count + np.searchsorted(key, np.sort(np.stack(pair, axis=1), axis=1) @ [count, 1])
        for pair in ((a, b), (b, c), (c, a))
    )
    middles = project(shape, points[edges].mean(axis=1))
    four = [np.stack(corners, axis=1) for corners in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    return np.concatenate([points, middles]), np.concatenate(four)
