"""Positions padded to four numbers, so that one load fetches a node."""

from massspring.kernels.jit.decorators import njit_inlined
from massspring.kernels.jit.flat import flat


@njit_inlined
def pad_positions(nodes, work, first, last):
    """Copies the positions of nodes first ≤ i < last to `padded_positions`, (n, 4), so that one load fetches a node."""
    x, padded = flat(nodes.x, first, last), flat(work.padded_positions, first, last)
    zero = nodes.x.dtype.type(0)
    for i in range(last - first):
        padded[4 * i], padded[4 * i + 1] = x[3 * i], x[3 * i + 1]
        padded[4 * i + 2], padded[4 * i + 3] = x[3 * i + 2], zero
