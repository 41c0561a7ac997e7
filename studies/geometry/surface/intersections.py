"""Finds where a triangulation meets itself apart from shared nodes and edges. Decisions are exact (predicates.py)."""

import numpy as np

from studies.geometry.surface.boxes import overlapping_boxes
from studies.geometry.surface.predicates import orientation, orientation_2

CLEAR = 1e-9
"""Relative distance from a separating plane beyond which rounding does not matter; nearer, decisions are exact."""


def crossing_triangles(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Pairs (c, 2) of triangles (t, 3) on points (n, 3) that have more points in common than shared nodes and edges.

    Touching counts, and so do neighbours that are folded flat onto each other. Triangles with the same three nodes are
    duplicates, not crossings; triangles with a repeated node are left out.
    """
    proper = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    numbers = np.flatnonzero(proper)
    corners = points[triangles[proper]]
    boxes = overlapping_boxes(corners.min(axis=1), corners.max(axis=1))
    crossings = [np.empty((0, 2), np.int64), *(crossing(points, triangles[proper], pairs) for pairs in boxes)]
    pairs = numbers[np.concatenate(crossings)]
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def crossing(points: np.ndarray, triangles: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Those of the pairs (p, 2) of triangles (t, 3) that cross, (c, 2)."""
    one, other = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
    same = one[:, :, None] == other[:, None, :]
    shared = same.sum(axis=(1, 2))
    crosses = np.zeros(len(pairs), bool)
    for count, test in ((0, apart_cross), (1, fan_cross), (2, fold_cross)):
        rows = np.flatnonzero(shared == count)
        if len(rows):
            # Shared nodes come first in both triangles.
            a = shared_first(one[rows], same[rows].any(axis=2))
            b = shared_first(other[rows], same[rows].any(axis=1))
            crosses[rows] = test(points[a], points[b])
    return pairs[crosses]


def shared_first(triangles: np.ndarray, shared: np.ndarray) -> np.ndarray:
    """The triangles (n, 3) with their shared corners first, in the order of their node numbers; shared (n, 3) bool."""
    keys = np.where(shared, triangles, triangles.max() + 1 + np.arange(3))
    return np.take_along_axis(triangles, np.argsort(keys, axis=1), axis=1)


def fold_cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Whether triangles (n, 3, 3) with a common edge, their first two corners, lie flat on one another."""
    along = a[:, 1] - a[:, 0]
    length = np.maximum(dot(along, along), 1e-300)[:, None]
    u, v = a[:, 2] - a[:, 0], b[:, 2] - a[:, 0]
    u, v = u - dot(u, along)[:, None] / length * along, v - dot(v, along)[:, None] / length * along
    folded = np.flatnonzero(dot(u, v) > 0)
    crosses = np.zeros(len(a), bool)
    crosses[folded] = orientation(a[folded, 0], a[folded, 1], a[folded, 2], b[folded, 2]) == 0
    return crosses


def fan_cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Whether triangles (n, 3, 3) with a common first corner meet elsewhere too."""
    u, v = unit(a[:, 1:] - a[:, :1]), unit(b[:, 1:] - b[:, :1])
    between = (u.sum(axis=1) - v.sum(axis=1))[:, None, :]
    # A plane through the common corner with one triangle on each side.
    least, most = dot(u, between).min(axis=1), dot(v, between).max(axis=1)
    maybe = np.flatnonzero((least <= CLEAR) | (most >= -CLEAR))
    crosses, a, b = np.zeros(len(a), bool), a[maybe], b[maybe]
    crosses[maybe] = segment_meets(a[:, 1], a[:, 2], b) | segment_meets(b[:, 1], b[:, 2], a)
    return crosses


def apart_cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Whether triangles (n, 3, 3) without common corners meet."""
    maybe = np.ones(len(a), bool)
    size = np.abs(np.concatenate([a, b], axis=1) - a[:, :1]).max(axis=(1, 2))
    for axis in (a.mean(axis=1) - b.mean(axis=1), normal(a), normal(b)):
        axis = unit(axis)[:, None, :]
        p, q = dot(a - a[:, :1], axis), dot(b - a[:, :1], axis)
        gap = np.maximum(p.min(axis=1) - q.max(axis=1), q.min(axis=1) - p.max(axis=1))
        maybe &= gap <= CLEAR * size
    a, b = a[maybe], b[maybe]
    meets = np.zeros(len(a), bool)
    for k in range(3):
        meets |= segment_meets(a[:, k - 1], a[:, k], b) | segment_meets(b[:, k - 1], b[:, k], a)
    maybe[maybe] = meets
    return maybe


def segment_meets(p: np.ndarray, q: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """Whether segments p, q (n, 3) and triangles (n, 3, 3) have a point in common."""
    a, b, c = triangle.transpose(1, 0, 2)
    side_p, side_q = orientation(a, b, c, p), orientation(a, b, c, q)
    flat = (side_p == 0) & (side_q == 0)
    through = ~flat & (side_p * side_q <= 0)
    rows = np.flatnonzero(through)
    turns = np.stack([orientation(p[rows], q[rows], s[rows], t[rows]) for s, t in ((a, b), (b, c), (c, a))])
    through[rows] = (turns >= 0).all(axis=0) | (turns <= 0).all(axis=0)
    rows = np.flatnonzero(flat)
    if len(rows):
        through[rows] = segment_meets_flat(p[rows], q[rows], triangle[rows])
    return through


def segment_meets_flat(p: np.ndarray, q: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """The same for segments in the plane of the triangle, projected along the largest component of its normal."""
    keep = np.argsort(np.abs(normal(triangle)), axis=1)[:, :2]
    p, q = np.take_along_axis(p, keep, axis=1), np.take_along_axis(q, keep, axis=1)
    corners = np.take_along_axis(triangle, keep[:, None, :], axis=2)
    a, b, c = corners.transpose(1, 0, 2)
    inside = np.stack([orientation_2(a, b, p), orientation_2(b, c, p), orientation_2(c, a, p)])
    meets = (inside >= 0).all(axis=0) | (inside <= 0).all(axis=0)
    for s, t in ((a, b), (b, c), (c, a)):
        across = orientation_2(p, q, s) * orientation_2(p, q, t) <= 0
        meets |= across & (orientation_2(s, t, p) * orientation_2(s, t, q) <= 0) & boxes_meet(p, q, s, t)
    return meets


def boxes_meet(p: np.ndarray, q: np.ndarray, s: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Whether the boxes of segments p, q and s, t (n, 2) touch, which decides for segments on one line."""
    low, high = np.minimum(p, q), np.maximum(p, q)
    touch = (low <= np.maximum(s, t)) & (np.minimum(s, t) <= high)
    return touch[:, 0] & touch[:, 1]


def dot(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Inner products along the last axis."""
    return (u * v).sum(axis=-1)


def unit(u: np.ndarray) -> np.ndarray:
    """Vectors scaled to length 1 along the last axis; zero stays zero."""
    return u / np.maximum(np.linalg.norm(u, axis=-1, keepdims=True), 1e-300)


def normal(triangle: np.ndarray) -> np.ndarray:
    """Normals (n, 3) of triangles (n, 3, 3), of any length."""
    return np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
