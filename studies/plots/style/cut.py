"""Bodies cut open by a plane: the remaining part of a surface, and the cut face of the tetrahedra."""

import numpy as np


def cut_surface(
    points: np.ndarray, triangles: np.ndarray, normal: np.ndarray, height: float
) -> tuple[np.ndarray, np.ndarray]:
    """The part x . normal <= height [m] of a surface of points (n, 3) [m] and triangles (t, 3), cut at the plane.

    normal: unit vector. Returns the corners (k, 3, 3) [m] of its triangles, and the index of the triangle from which
    each comes (k,).
    """
    above = points @ normal - height
    over = above[triangles] > 0
    count = over.sum(axis=1)
    pieces, source = [points[triangles[count == 0]]], [np.flatnonzero(count == 0)]
    for kept in (1, 2):
        rows = np.flatnonzero(count == 3 - kept)
        # The corner that is alone on its side comes first.
        alone = (over[rows] == (kept == 2)).argmax(axis=1)
        a, b, c = points[np.take_along_axis(triangles[rows], (alone[:, None] + [0, 1, 2]) % 3, axis=1)].transpose(
            1, 0, 2
        )
        ab, ac = _crossing(a, b, normal, height), _crossing(a, c, normal, height)
        parts = [(a, ab, ac)] if kept == 1 else [(ab, b, c), (ab, c, ac)]
        pieces += [np.stack(part, axis=1) for part in parts]
        source += [rows] * len(parts)
    return np.concatenate(pieces), np.concatenate(source)


def cut_face(points: np.ndarray, tetrahedra: np.ndarray, normal: np.ndarray, height: float) -> np.ndarray:
    """Polygons (p, 4, 3) [m] in which the plane x . normal = height [m] cuts tetrahedra (k, 4) on points (n, 3) [m].

    Triangles repeat a corner; the order of the corners, clockwise or not, varies.
    """
    over = (points @ normal > height)[tetrahedra]
    count = over.sum(axis=1)
    faces = [np.empty((0, 4, 3))]
    for few in (1, 3):
        cells = tetrahedra[count == few]
        first = (over[count == few] == (few == 1)).argmax(axis=1)
        a, b, c, d = _turned(points, cells, first)
        corners = [_crossing(a, other, normal, height) for other in (b, c, d)]
        faces.append(np.stack([*corners, corners[-1]], axis=1))
    cells = tetrahedra[count == 2]
    cells = np.take_along_axis(cells, np.argsort(over[count == 2], axis=1, kind="stable"), axis=1)
    a, b, c, d = points[cells].transpose(1, 0, 2)
    ring = [(a, c), (a, d), (b, d), (b, c)]
    faces.append(np.stack([_crossing(p, q, normal, height) for p, q in ring], axis=1))
    return np.concatenate(faces)


def _turned(points: np.ndarray, cells: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Corners (4, k, 3) of the cells, with the local corner `first` (k,) as the first one."""
    return points[np.take_along_axis(cells, (first[:, None] + np.arange(4)) % 4, axis=1)].transpose(1, 0, 2)


def _crossing(a: np.ndarray, b: np.ndarray, normal: np.ndarray, height: float) -> np.ndarray:
    """Points (k, 3) where the segments from a to b (k, 3) meet the plane."""
    before, after = a @ normal - height, b @ normal - height
    share = before / (before - after)
    return a + share[:, None] * (b - a)
