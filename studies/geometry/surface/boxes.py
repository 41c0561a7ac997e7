"""Finds overlapping boxes: the broad phase of a search for intersections."""

from collections.abc import Iterator

import numpy as np

AT_ONCE = 1_000_000
"""Pairs of boxes that are followed at the same time: some tens of megabytes."""
BITS = 10


def overlapping_boxes(low: np.ndarray, high: np.ndarray) -> Iterator[np.ndarray]:
    """Yields in portions the pairs (p, 2), lower index first, of boxes with corners low, high (n, 3) that touch.

    The boxes are sorted along a Z-curve. Repeated halving of that order gives a tree of bounding boxes without
    pointers, and pairs of tree nodes are followed downwards as long as their boxes touch.
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
    """The pairs whose boxes have a point in common."""
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
