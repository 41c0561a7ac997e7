"""Tests whether a curved tetrahedron is folded anywhere, not only at sample points."""

from itertools import product

import numpy as np

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
