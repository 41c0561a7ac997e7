"""Divides the tetrahedra that a sheet crosses, and measures how much of each section a blade covers.

A sheet is the surface level = 0 of a level that is given at the nodes.
"""

from collections.abc import Callable

import numpy as np

from studies.geometry.mesh.organ_mesh import triangle_areas, turn_inverted

SUBDIVIDED = 8
"""Parts of a side of the triangles of a section: the blade is evaluated at the square of this, 64 points."""
SECTIONS = (
    (1, ((0, 1), (0, 2), (0, 3))),
    (2, ((0, 2), (0, 3), (1, 3))),
    (2, ((0, 2), (1, 3), (1, 2))),
    (3, ((0, 3), (1, 3), (2, 3))),
)
"""Triangles of the sections of a tetrahedron, whose corners are numbered from front to back: number of corners in front
of the sheet, and the edges on which the corners of the triangle lie."""


def _middles(parts: int) -> np.ndarray:
    """Barycentric coordinates (parts², 3) of the centroids of the parts² equal parts of a triangle."""
    i, j = (grid.ravel() for grid in np.mgrid[:parts, :parts])
    up, down = i + j < parts, i + j < parts - 1
    first, second = (np.concatenate([k[up] + 1 / 3, k[down] + 2 / 3]) / parts for k in (i, j))
    return np.stack([first, second, 1.0 - first - second], axis=1)


PLACES = _middles(SUBDIVIDED)


def crossing_edges(cells: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Edges (e, 2) of `cells` (k, 4) that cross a sheet, each once: first the node in front, where `level` (n,) > 0,
    then the node behind."""
    ends = cells[:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]].reshape(-1, 2)
    ends = ends[(level[ends] > 0).sum(axis=1) == 1]
    ends = np.where((level[ends[:, :1]] > 0), ends, ends[:, ::-1])
    return np.unique(ends, axis=0)


def crossings(points: np.ndarray, level: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where `edges` (e, 2) cross the sheet: the weight of their second end, (e,), and the point [m], (e, 3)."""
    first, second = level[edges].T
    share = first / (first - second)
    return share, points[edges[:, 0]] + share[:, None] * (points[edges[:, 1]] - points[edges[:, 0]])


def divided(
    points: np.ndarray, cells: np.ndarray, level: np.ndarray, edges: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Divides the cells that a sheet crosses: tetrahedra (t, 4) of positive volume, and their side (t,), 1 in front.

    points (n, 3) [m], cells (k, 4), level (n,), edges (e, 2) of `crossing_edges`. Node n + e is the point where edge e
    crosses the sheet. Both sides and neighbouring cells divide a common quadrilateral in the same way, by the diagonal
    at its smallest node number (Dompierre, Labbé, Vallet, Camarero 1999).
    """
    n = len(points)
    places = np.concatenate([points, crossings(points, level, edges)[1]])
    key = edges @ [n, 1]
    rows = cells[np.ptp(np.sign(level[cells]), axis=1) > 0]
    rows = np.take_along_axis(rows, np.argsort(-level[rows], axis=1), axis=1)
    count = (level[rows] > 0).sum(axis=1)
    parts, sides = [], []

    def add(tetrahedra: np.ndarray, side: int) -> None:
        parts.append(tetrahedra)
        sides.append(np.full(len(tetrahedra), side))

    for few in (1, 2, 3):
        a, b, c, d = rows[count == few].T

        def at(front: np.ndarray, behind: np.ndarray) -> np.ndarray:
            return n + np.searchsorted(key, front * n + behind)

        if few == 1:
            add(np.stack([a, at(a, b), at(a, c), at(a, d)], axis=1), 1)
            add(_of_wedges(np.stack([b, c, d, at(a, b), at(a, c), at(a, d)], axis=1)), -1)
        elif few == 2:
            add(_of_wedges(np.stack([a, at(a, c), at(a, d), b, at(b, c), at(b, d)], axis=1)), 1)
            add(_of_wedges(np.stack([c, at(a, c), at(b, c), d, at(a, d), at(b, d)], axis=1)), -1)
        else:
            add(_of_wedges(np.stack([a, b, c, at(a, d), at(b, d), at(c, d)], axis=1)), 1)
            add(np.stack([d, at(a, d), at(b, d), at(c, d)], axis=1), -1)
    return turn_inverted(places, np.concatenate(parts)), np.concatenate(sides)


def _of_wedges(wedges: np.ndarray) -> np.ndarray:
    """Divides each of the wedges (w, 6), whose node i faces node i + 3, into three tetrahedra, (3 w, 4)."""
    # The smallest number comes first: both quadrilaterals at that node are divided from it.
    first = np.argmin(wedges, axis=1)
    order = np.array([[0, 1, 2, 3, 4, 5], [1, 2, 0, 4, 5, 3], [2, 0, 1, 5, 3, 4]])
    order = np.concatenate([order, order[:, [3, 4, 5, 0, 1, 2]]])
    w = np.take_along_axis(wedges, order[first], axis=1)
    straight = np.minimum(w[:, 1], w[:, 5]) < np.minimum(w[:, 2], w[:, 4])
    one = w[:, [[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]]]
    other = w[:, [[0, 1, 2, 4], [0, 4, 2, 5], [0, 4, 5, 3]]]
    return np.where(straight[:, None, None], one, other).reshape(-1, 4)


def covered_part(
    points: np.ndarray, cells: np.ndarray, level: np.ndarray, covers: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """The share of the section of each cell that a blade covers [1], (k,), to about 1 %; 0 for cells without a section.

    covers: points (q, 3) [m] on the sheet -> bool (q,).
    """
    covered, whole = np.zeros(len(cells)), np.zeros(len(cells))
    order = np.argsort(-level[cells], axis=1)
    count = (level[cells] > 0).sum(axis=1)
    for few, corners in SECTIONS:
        here = np.flatnonzero(count == few)
        rows = np.take_along_axis(cells[here], order[here], axis=1)
        triangle = np.stack([crossings(points, level, rows[:, list(ends)])[1] for ends in corners], axis=1)  # (c, 3, 3)
        area = triangle_areas(triangle.reshape(-1, 3), np.arange(3 * len(here)).reshape(-1, 3))
        places = np.einsum("qa,cai->cqi", PLACES, triangle)
        inside = covers(places.reshape(-1, 3)).reshape(len(here), len(PLACES)).mean(axis=1)
        covered[here] += area * inside
        whole[here] += area
    return np.divide(covered, whole, out=np.zeros(len(cells)), where=whole > 0)
