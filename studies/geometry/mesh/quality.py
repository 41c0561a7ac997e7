"""Quality measures of triangles and tetrahedra: their shapes, and whether curved ones are folded anywhere."""

from itertools import product

import numpy as np

from studies.geometry.mesh.organ_mesh import tetrahedron_volumes, triangle_areas

MIN_DIHEDRAL, MIN_RATIO = 8.0, 0.1
"""Dihedral angle [degrees] and radius ratio below which an element stiffens the body and forces a small time step."""
MIN_WALL_RATIO = 0.05
"""Smallest radius ratio in a thin wall, whose elements are flat by nature."""
PAIRS = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
"""Ends of the six edges in the order of the mid-side nodes 4 to 9 (VTK's quadratic tetrahedron)."""

_NODE = {(i, i): i for i in range(4)} | {pair: 4 + k for k, pair in enumerate(PAIRS)}
_NODE |= {(j, i): k for (i, j), k in _NODE.items()}


def _cubic_terms() -> tuple[np.ndarray, np.ndarray]:
    """The row of each of the 64 products of linear terms among the 20 cubic terms, and how often each row occurs."""
    exponents = [tuple(np.bincount(triple, minlength=4)) for triple in product(range(4), repeat=3)]
    rows = {exponent: k for k, exponent in enumerate(sorted(set(exponents)))}
    row = np.array([rows[exponent] for exponent in exponents])
    return row, np.bincount(row)


_ROW, _TIMES = _cubic_terms()


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


def jacobian_coefficients(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Bernstein coefficients [m^3], shape (k, 20), of det dx/dxi of quadratic tetrahedra (k, 10) in the order of VTK.

    The determinant is a cubic polynomial and lies between its smallest and largest coefficient, so an element with
    positive coefficients is folded nowhere. All 20 coefficients of a straight element are 6 V. Johnen, Remacle,
    Geuzaine: Geometrical validity of curvilinear finite elements, J. Comput. Phys. 233 (2013).
    """
    x = points[cells]
    control = x.copy()
    for k, (i, j) in enumerate(PAIRS):
        control[:, 4 + k] = 2.0 * x[:, 4 + k] - 0.5 * (x[:, i] + x[:, j])
    # dx/dxi_k is linear: its coefficients are differences of control points along edge k.
    columns = np.empty((3, 4, *x.shape[::2]))
    for k, j in product(range(3), range(4)):
        columns[k, j] = 2.0 * (control[:, _NODE[j, k + 1]] - control[:, _NODE[j, 0]])
    coefficients = np.zeros((20, len(cells)))
    crossed = {(j, m): np.cross(columns[1, j], columns[2, m]) for j, m in product(range(4), repeat=2)}
    for row, (i, j, m) in zip(_ROW, product(range(4), repeat=3), strict=True):
        coefficients[row] += np.einsum("ij,ij->i", columns[0, i], crossed[j, m])
    return (coefficients / _TIMES[:, None]).T


def scaled_coefficients(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Bernstein coefficients, shape (k, 20), over 6 V of the straight element with the same vertices [1]."""
    a, b, c, d = points[cells[:, :4]].transpose(1, 0, 2)
    straight = np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a))
    return jacobian_coefficients(points, cells) / straight[:, None]


def smallest_jacobian(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Lower bound, shape (k,), of det dx/dxi over 6 V of the straight element with the same vertices [1]: 1 for a
    straight element, 0 or less for one that may be folded."""
    return scaled_coefficients(points, cells).min(axis=1)


def curved_volume(points: np.ndarray, cells: np.ndarray) -> float:
    """Volume [m^3] of all cells. The mean of the coefficients is the mean of the determinant, 6 V."""
    return float(jacobian_coefficients(points, cells).mean(axis=1).sum() / 6.0)
