"""Exact distances of points and grid points to triangles, in compiled code."""

import numpy as np

from massspring.kernels.jit.decorators import compiled

FLAT = 1e-20
"""Squared sine of the angle at the first corner below which a triangle is a line, whose normal would be rounding."""


@compiled
def squared_to_segment(w0: float, w1: float, w2: float, d0: float, d1: float, d2: float):
    """Squared distance of a point to a segment, |w - s d|² at the nearest s in [0, 1]; w: from its start to the point;
    d: from its start to its end."""
    length = d0 * d0 + d1 * d1 + d2 * d2
    along = w0 * d0 + w1 * d1 + w2 * d2
    s = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
    r0, r1, r2 = w0 - s * d0, w1 - s * d1, w2 - s * d2
    return r0 * r0 + r1 * r1 + r2 * r2


@compiled
def squared_to_triangle(p: np.ndarray, triangle: np.ndarray, u: np.ndarray, v: np.ndarray, n: np.ndarray):
    """Squared distance of the point p (3,) to a triangle (3, 3) with edges u, v from its first corner, n = u x v.

    Over the face it is (w·n)²/n², w from the first corner to p. Elsewhere, and for a triangle so flat that its normal
    would be rounding, it is the squared distance to the nearest edge.
    """
    w0, w1, w2 = p[0] - triangle[0, 0], p[1] - triangle[0, 1], p[2] - triangle[0, 2]
    square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2]
    if square > FLAT * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]) * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]):
        # Barycentric coordinates of the foot, times n²: s = (w x v)·n, t = (u x w)·n.
        s = (w1 * v[2] - w2 * v[1]) * n[0] + (w2 * v[0] - w0 * v[2]) * n[1] + (w0 * v[1] - w1 * v[0]) * n[2]
        t = (u[1] * w2 - u[2] * w1) * n[0] + (u[2] * w0 - u[0] * w2) * n[1] + (u[0] * w1 - u[1] * w0) * n[2]
        if s >= 0.0 and t >= 0.0 and s + t <= square:
            height = w0 * n[0] + w1 * n[1] + w2 * n[2]
            return height * height / square
    first = squared_to_segment(w0, w1, w2, u[0], u[1], u[2])
    second = squared_to_segment(w0, w1, w2, v[0], v[1], v[2])
    e0, e1, e2 = p[0] - triangle[1, 0], p[1] - triangle[1, 1], p[2] - triangle[1, 2]
    third = squared_to_segment(e0, e1, e2, v[0] - u[0], v[1] - u[1], v[2] - u[2])
    return min(first, second, third)


@compiled
def edges_into(triangle: np.ndarray, u: np.ndarray, v: np.ndarray, n: np.ndarray):
    """Writes the edges u, v (3,) from the first corner of a triangle (3, 3) and n = u x v; returns n²."""
    for k in range(3):
        u[k] = triangle[1, k] - triangle[0, k]
        v[k] = triangle[2, k] - triangle[0, k]
    n[0], n[1], n[2] = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    return n[0] * n[0] + n[1] * n[1] + n[2] * n[2]


@compiled
def nearest_into(
    queries: np.ndarray,
    corners: np.ndarray,
    near: np.ndarray,
    scratch: np.ndarray,
    squared: np.ndarray,
    nearest: np.ndarray,
):
    """Writes into squared (q,) the squared distance of each of `queries` (q, 3) to the nearest of its triangles `near`
    (q, k) among corners (f, 3, 3), and into nearest (q,) the index of that triangle; scratch (3, 3)."""
    u, v, n = scratch
    for q in range(len(queries)):
        squared[q] = np.inf
        for f in near[q]:
            edges_into(corners[f], u, v, n)
            away = squared_to_triangle(queries[q], corners[f], u, v, n)
            if away < squared[q]:
                squared[q] = away
                nearest[q] = f


@compiled
def band_distance_into(corners: np.ndarray, reach: float, scratch: np.ndarray, squared: np.ndarray, owner: np.ndarray):
    """Lowers squared (a, b, c) to the squared distance to the triangles, at grid points within `reach` of their boxes;
    owner (a, b, c) gets the index of the nearest one. Lengths in cells, coordinates from the first grid point; corners
    (t, 3, 3); scratch (4, 3)."""
    u, v, n, p = scratch
    for f in range(len(corners)):
        triangle = corners[f]
        square = edges_into(triangle, u, v, n)
        i0, i1 = cells_between(triangle[:, 0], reach, squared.shape[0])
        j0, j1 = cells_between(triangle[:, 1], reach, squared.shape[1])
        k0, k1 = cells_between(triangle[:, 2], reach, squared.shape[2])
        for i in range(i0, i1):
            for j in range(j0, j1):
                for k in range(k0, k1):
                    p[0], p[1], p[2] = i, j, k
                    height = (i - triangle[0, 0]) * n[0] + (j - triangle[0, 1]) * n[1] + (k - triangle[0, 2]) * n[2]
                    # The plane of a triangle is never farther away than the triangle itself.
                    if height * height <= squared[i, j, k] * square:
                        away = squared_to_triangle(p, triangle, u, v, n)
                        if away < squared[i, j, k]:
                            squared[i, j, k] = away
                            owner[i, j, k] = f


@compiled
def far_distance_into(corners: np.ndarray, reach: float, owner: np.ndarray, scratch: np.ndarray, squared: np.ndarray):
    """Lowers squared (a, b, c), where it is over reach² [cells²], to that to the triangle owner (a, b, c); corners (t,
    3, 3); scratch (4, 3)."""
    u, v, n, p = scratch
    for i in range(squared.shape[0]):
        for j in range(squared.shape[1]):
            for k in range(squared.shape[2]):
                if squared[i, j, k] > reach * reach:
                    p[0], p[1], p[2] = i, j, k
                    triangle = corners[owner[i, j, k]]
                    edges_into(triangle, u, v, n)
                    squared[i, j, k] = min(squared[i, j, k], squared_to_triangle(p, triangle, u, v, n))


@compiled
def cells_between(coordinates: np.ndarray, reach: float, size: int):
    """First grid row within `reach` of three coordinates, and the one after the last, limited to [0, size]."""
    low = min(coordinates[0], coordinates[1], coordinates[2]) - reach
    high = max(coordinates[0], coordinates[1], coordinates[2]) + reach
    return max(int(-(-low // 1)), 0), min(int(high // 1) + 1, size)
