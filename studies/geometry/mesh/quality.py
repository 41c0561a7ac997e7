"""Quality measures of triangles and tetrahedra."""

import numpy as np

from studies.geometry.mesh.organ_mesh import tetrahedron_volumes, triangle_areas

MIN_DIHEDRAL, MIN_RATIO = 8.0, 0.1
"""Dihedral angle [degrees] and radius ratio below which an element stiffens the body and forces a small time step."""
MIN_WALL_RATIO = 0.05
"""Smallest radius ratio in a thin wall, whose elements are flat by nature."""


def triangle_radius_ratio(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """2 r_in / r_circum = 16 A^2 / (a b c (a + b + c)), shape (t,): 1 for an equilateral triangle, 0 for a flat one."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    la, lb, lc = (np.linalg.norm(d, axis=1) for d in (b - c, c - a, a - b))
    area = triangle_areas(points, triangles)
    return 16.0 * area**2 / np.maximum(la * lb * lc * (la + lb + lc), 1e-300)


def tetrahedron_radius_ratio(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """3 r_in / r_circum, shape (k,): 1 for a regular tetrahedron, 0 for a flat one, negative for an inverted one.

    r_in = 3 V / sum A; r_circum = sqrt(s (s - p)(s - q)(s - r)) / (6 V) with p, q, r the products of opposite edges.
    """
    x = points[tetrahedra]
    volume = tetrahedron_volumes(points, tetrahedra)
    area = sum(
        triangle_areas(points, tetrahedra[:, list(face)]) for face in ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))
    )
    edge = {(i, j): np.linalg.norm(x[:, j] - x[:, i], axis=1) for i in range(4) for j in range(i + 1, 4)}
    p, q, r = edge[0, 1] * edge[2, 3], edge[0, 2] * edge[1, 3], edge[0, 3] * edge[1, 2]
    s = (p + q + r) / 2.0
    root = np.sqrt(np.maximum(s * (s - p) * (s - q) * (s - r), 0.0))
    return 54.0 * volume * np.abs(volume) / np.maximum(area * root, 1e-300)


def dihedral_angles(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """The six dihedral angles [degrees] of each tetrahedron, shape (k, 6)."""
    x = points[tetrahedra]
    normals = []
    for i, j, k in ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)):
        n = np.cross(x[:, j] - x[:, i], x[:, k] - x[:, i])
        normals.append(n / np.maximum(np.linalg.norm(n, axis=1), 1e-300)[:, None])
    pairs = [(i, j) for i in range(4) for j in range(i + 1, 4)]
    cosines = np.stack([-np.einsum("ij,ij->i", normals[i], normals[j]) for i, j in pairs], axis=1)
    return np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
