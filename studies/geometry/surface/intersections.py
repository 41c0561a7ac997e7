"""Finds where a triangulation meets itself apart from shared nodes and edges.

Overlapping boxes are searched first. The decisions about their triangles are exact: floating point first, integers
where its error bound does not suffice.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

CLEAR = 1e-9
"""Relative distance from a separating plane beyond which rounding does not matter; nearer, decisions are exact."""
AT_ONCE = 1_000_000
"""Pairs of boxes that are followed at the same time: some tens of megabytes."""
BITS = 10
BOUND_3, BOUND_2 = 7.8e-16, 3.4e-16
"""Upper bounds of the rounding of the determinants in three and two dimensions, relative to the sum of the absolute
values of the products (Shewchuk 1997, Adaptive precision floating-point arithmetic and fast robust geometric
predicates, bounds A)."""


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
        # For segments on one line their boxes decide.
        touch = (np.minimum(p, q) <= np.maximum(s, t)) & (np.minimum(s, t) <= np.maximum(p, q))
        meets |= across & (orientation_2(s, t, p) * orientation_2(s, t, q) <= 0) & touch.all(axis=1)
    return meets


def dot(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return (u * v).sum(axis=-1)


def unit(u: np.ndarray) -> np.ndarray:
    return u / np.maximum(np.linalg.norm(u, axis=-1, keepdims=True), 1e-300)


def normal(triangle: np.ndarray) -> np.ndarray:
    """Normals (n, 3) of triangles (n, 3, 3), of any length."""
    return np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])


def overlapping_boxes(low: np.ndarray, high: np.ndarray) -> Iterator[np.ndarray]:
    """Yields in portions the pairs (p, 2), lower index first, of boxes with corners low, high (n, 3) that touch.

    Repeated halving of their order along a Z-curve gives a tree of bounding boxes without pointers; pairs of tree nodes
    are followed downwards as long as their boxes touch.
    """
    if not len(low):
        return
    order = np.argsort(z_curve((low + high) / 2.0), kind="stable")
    levels = tree(low[order], high[order])
    waiting = [(0, np.zeros((1, 2), np.int64))]
    while waiting:
        depth, pairs = waiting.pop()
        if depth == len(levels) - 1:
            overlaps = order[pairs[pairs[:, 0] < pairs[:, 1]]]
            if len(overlaps):
                yield np.sort(overlaps, axis=1)
            continue
        pairs = touching(children(pairs), *levels[depth + 1])
        waiting += [(depth + 1, pairs[first : first + AT_ONCE]) for first in range(0, len(pairs), AT_ONCE)]


def children(pairs: np.ndarray) -> np.ndarray:
    """Pairs of children of pairs of tree nodes (p, 2), each once: a pair of a node with itself has three."""
    a, b = 2 * pairs.T
    every = np.concatenate([np.stack([a + i, b + j], axis=1) for i in (0, 1) for j in (0, 1)])
    return every[every[:, 0] <= every[:, 1]]


def touching(pairs: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    a, b = pairs.T
    keep = np.ones(len(pairs), bool)
    for k in range(3):
        keep &= (low[a, k] <= high[b, k]) & (low[b, k] <= high[a, k])
    return pairs[keep]


def tree(low: np.ndarray, high: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Low and high corners of the boxes of all levels, the root first; boxes that touch nothing fill the last level."""
    size = 1 << max(0, int(np.ceil(np.log2(len(low)))))
    empty = np.full((size - len(low), 3), np.inf)
    levels = [(np.concatenate([low, empty]), np.concatenate([high, -empty]))]
    while len(levels[0][0]) > 1:
        low, high = levels[0]
        levels.insert(0, (np.minimum(low[::2], low[1::2]), np.maximum(high[::2], high[1::2])))
    return levels


def z_curve(points: np.ndarray) -> np.ndarray:
    """Positions (n,) of points (n, 3) on a Z-curve through their box: the interleaved bits of their coordinates."""
    span = np.maximum(np.ptp(points, axis=0), 1e-300)
    cells = ((points - points.min(axis=0)) / span * (2**BITS - 1)).astype(np.int64)
    bits = [((cells[:, k] >> bit) & 1) << (3 * bit + k) for bit in range(BITS) for k in range(3)]
    return np.sum(bits, axis=0)


def orientation(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Sign of det(a - d, b - d, c - d), shape (n,) int, for points (n, 3): 1 if d lies below the plane of a, b, c,
    which are anticlockwise seen from above, and 0 exactly in the plane."""
    u, v, w = a - d, b - d, c - d
    positive = [u[:, i] * v[:, j] * w[:, k] for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]
    negative = [u[:, i] * v[:, j] * w[:, k] for i, j, k in ((2, 1, 0), (1, 0, 2), (0, 2, 1))]
    value = np.asarray(sum(positive) - sum(negative))
    return decided(value, BOUND_3, positive + negative, (a, b, c, d), exact_3)


def orientation_2(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Sign of det(a - c, b - c), shape (n,) int, for points (n, 2): 1 if a, b, c are anticlockwise."""
    u, v = a - c, b - c
    products = [u[:, 0] * v[:, 1], u[:, 1] * v[:, 0]]
    return decided(products[0] - products[1], BOUND_2, products, (a, b, c), exact_2)


def decided(
    value: np.ndarray,
    bound: float,
    products: Sequence[np.ndarray],
    corners: Sequence[np.ndarray],
    exact: Callable[..., np.ndarray],
) -> np.ndarray:
    """Signs of the determinants `value` (n,), decided by `exact` where twice the rounding error may exceed them."""
    doubtful = np.abs(value) < 2.0 * bound * sum(np.abs(product) for product in products)
    sign = np.sign(value).astype(int)
    if doubtful.any():
        sign[doubtful] = exact(*whole_numbers([corner[doubtful] for corner in corners]))
    return sign


def whole_numbers(arrays: list[np.ndarray]) -> list[np.ndarray]:
    """The coordinates as Python integers, all multiplied by the same power of two."""
    parts = [np.frexp(array) for array in arrays]
    least = min(int(exponent.min()) for _, exponent in parts)
    scaled = []
    for mantissa, exponent in parts:
        whole = (mantissa * 2.0**53).astype(np.int64).astype(object)
        scaled.append(whole * np.array([1 << int(e) for e in (exponent - least).ravel()], object).reshape(whole.shape))
    return scaled


def exact_3(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Signs of det(a - d, b - d, c - d) for integer coordinates (n, 3)."""
    (ux, uy, uz), (vx, vy, vz), (wx, wy, wz) = (a - d).T, (b - d).T, (c - d).T
    value = ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)
    return (value > 0).astype(int) - (value < 0).astype(int)


def exact_2(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Signs of det(a - c, b - c) for integer coordinates (n, 2)."""
    (ux, uy), (vx, vy) = (a - c).T, (b - c).T
    value = ux * vy - uy * vx
    return (value > 0).astype(int) - (value < 0).astype(int)
