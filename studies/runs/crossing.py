"""Whether a body passes through itself: nothing keeps lobes, walls or faces of a cut apart, so they overlap."""

import numpy as np

from massspring.body.surface import winding_number
from studies.geometry.mesh.organ_mesh import triangle_areas, triangle_normals
from studies.geometry.surface.intersections import crossing_triangles

DEPTH = 2e-3
"""Depth from which a place below the surface counts, over the size: faces of a cut that contact keeps apart overlap by
up to half of it."""


def crossed(triangles: np.ndarray, rest: np.ndarray, positions: np.ndarray) -> float:
    """Largest share of the surface, by its area at rest, that lies inside the body at one of `positions` (K, n, 3) [m],
    beyond that at rest [1]. triangles: (s, 3), closed and outward."""
    area = triangle_areas(rest, triangles)
    depth = DEPTH * float(np.linalg.norm(np.ptp(rest, axis=0)))
    inside = max((area[_covered(triangles, x, depth)].sum() for x in positions), default=0.0)
    before = area[_covered(triangles, rest, depth)].sum() if inside > 0.0 else 0.0
    return float(max(0.0, inside - before) / area.sum())


def _covered(triangles: np.ndarray, x: np.ndarray, depth: float) -> np.ndarray:
    """The triangles so deep below whose middles the body is twice; looked for only where two of them cross."""
    if not len(crossing_triangles(x, triangles)):
        return np.zeros(0, dtype=np.intp)
    normals = triangle_normals(x, triangles)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    places = x[triangles].mean(axis=1) - depth * normals / np.maximum(lengths, np.finfo(float).tiny)
    return np.flatnonzero([winding_number(place, x, triangles) > 1.5 for place in places])
