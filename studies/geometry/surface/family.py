"""The volume to which a family of meshes converges."""

import numpy as np

from studies.geometry.mesh.organ_mesh import signed_volume, unique_edges
from studies.geometry.shape.levelset import Shape, at_depth, project
from studies.geometry.surface.first_surface import first_surface


def true_volume(shape: Shape, refinements: int = 2) -> float:
    """Volume [m^3] of the tissue of a shape, without its lumen, to about 1e-6 of it; see `enclosed_volume`."""
    outer = enclosed_volume(shape, refinements)
    return outer if shape.wall is None else outer - enclosed_volume(at_depth(shape, shape.wall), refinements)


def enclosed_volume(shape: Shape, refinements: int) -> float:
    """Volume [m^3] inside f = 0. Raises StudyError if the surface is not inside its box.

    The triangles of a fine triangulation are quartered `refinements` times, with nodes on the true surface. The volume
    is a series in the squared edge length, which Romberg's scheme extrapolates.
    """
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
