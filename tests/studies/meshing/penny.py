"""A quarter of a ball with a slit like a penny, made without a mesher: shells of oblate spheroids round a disc."""

import numpy as np

from tests.massspring.quadratic import upright

EDGE = 0.01  # of the polygon that stands for the slit's edge, from the axis to its corners [m]
BALL = 10.0 * EDGE
SHELLS = (0.0, 0.15, 0.3, 0.5, 0.75, 1.05, 1.4, 1.9, 2.4, np.arccosh(BALL / EDGE))
"""u of the shells, whose points are (cosh u cos v, sinh u sin v): near the edge they are as fine as the stress there
asks for, and the last is a ball."""
LEVELS = 3


def area(levels: int = LEVELS) -> float:
    """Of the whole slit [m²], a polygon."""
    sides = 2 ** (levels + 2)
    return 0.5 * sides * EDGE**2 * np.sin(2.0 * np.pi / sides)


def quarter_sphere(levels: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of an octahedron's quarter x, y >= 0, split `levels` times, those on the equator first, and triangles."""
    points, triangles = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1]]), np.array([[0, 1, 2], [1, 0, 3]])
    for _ in range(levels):
        ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, inverse = np.unique(ends, axis=0, return_inverse=True)
        ab, bc, ca = (len(points) + inverse.reshape(-1, 3)).T
        points = np.vstack([points, points[unique].mean(axis=1)])
        a, b, c = triangles.T
        triangles = np.vstack([np.column_stack(t) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    order = np.argsort(points[:, 2] != 0, kind="stable")
    return points[order] / np.linalg.norm(points[order], axis=1)[:, None], np.argsort(order)[triangles]


def penny(levels: int = LEVELS, innermost: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3) [m], tetrahedra (k, 4), and triangles (f, 3) of the innermost shell with z >= 0, seen from above.

    The innermost shell is u = 0: both its sides lie on each other and are glued, so its triangles are faces between
    tetrahedra. With another u it is the wall of a lumen."""
    direction, triangles = quarter_sphere(levels)
    n, shells = len(direction), (innermost, *SHELLS[1:])
    points = np.vstack([EDGE * direction * [np.cosh(u), np.cosh(u), np.sinh(u)] for u in shells])
    cells = []
    for shell in range(len(shells) - 1):
        # Nodes of the equator have the least numbers: no tetrahedron lies flat in its plane.
        a, b, c = (shell * n + np.sort(triangles, axis=1)).T
        p, q, r = (a + n, b + n, c + n)
        cells += [np.column_stack(part) for part in ((a, b, c, r), (a, b, q, r), (a, p, q, r))]
    _, first, inverse = np.unique(np.round(points / EDGE, 9) + 0.0, axis=0, return_index=True, return_inverse=True)
    inverse, cells = inverse.reshape(-1), np.vstack(cells)
    above = triangles[(direction[triangles, 2] >= 0).all(axis=1)]
    return points[first], upright(points[first], inverse[cells]), inverse[above]
