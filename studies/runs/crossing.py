"""Whether a body passes through itself: nothing keeps lobes or walls apart that meet, so they overlap."""

import numpy as np

from massspring.body.surface import winding_number
from studies.geometry.mesh.organ_mesh import triangle_areas, triangle_normals
from studies.geometry.surface.intersections import crossing_triangles

BESIDE = 1e-3
"""Distance from a triangle at which it is looked what lies outside of it, over its size."""


def crossed(triangles: np.ndarray, rest: np.ndarray, positions: np.ndarray) -> float:
    """Largest share of the surface, by its area at rest, whose outer side lies inside the body at one of `positions`
    (K, n, 3) [m], beyond that at rest [1]. triangles: (s, 3), closed and outward."""
    area = triangle_areas(rest, triangles)
    inside = [area[_covered(triangles, x)].sum() for x in (rest, *positions)]
    return float(max(0.0, *np.subtract(inside[1:], inside[0])) / area.sum())


def _covered(triangles: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The triangles whose outer side lies inside the body; looked for only where two of them cross."""
    if not len(crossing_triangles(x, triangles)):
        return np.zeros(0, dtype=np.intp)
    normals = triangle_normals(x, triangles)
    size = np.sqrt(np.linalg.norm(normals, axis=1, keepdims=True))
    places = x[triangles].mean(axis=1) + BESIDE * normals / np.maximum(size, np.finfo(float).tiny)
    return np.flatnonzero([winding_number(place, x, triangles) > 0.5 for place in places])
