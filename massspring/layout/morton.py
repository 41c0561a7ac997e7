"""A node order in which neighbours in space are near in memory."""

import numpy as np

CURVE_BITS = 20  # per axis: a millionth of the body, so that no two nodes share a cell


def along_curve(x: np.ndarray) -> np.ndarray:
    """Position of each point along a space-filling curve, Morton's order, (n,).

    It interleaves the bits of the three coordinates x [m], (n, 3) (Morton 1966).
    """
    cells = 1 << CURVE_BITS
    size = max(float(np.ptp(x, axis=0).max()), np.finfo(float).tiny)
    cell = np.minimum((x - x.min(axis=0)) / size * cells, cells - 1).astype(np.int64)
    key = np.zeros(len(x), dtype=np.int64)
    for bit in range(CURVE_BITS):
        for axis in range(3):
            key |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    place = np.empty(len(x), dtype=np.int64)
    place[np.argsort(key, kind="stable")] = np.arange(len(x))
    return place
