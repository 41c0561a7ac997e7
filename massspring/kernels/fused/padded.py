"""Positions padded to four numbers, as one move of memory fetches them."""

from massspring.kernels.jit.decorators import njit_inlined
from massspring.kernels.jit.flat import flat


@njit_inlined
def pad_positions(nodes, work, first, last):
    """The positions of some nodes in fours, as one move of memory fetches them, (n, 4)."""
    x, padded = flat(nodes.x, first, last), flat(work.padded_positions, first, last)
    zero = nodes.x.dtype.type(0)
    for i in range(last - first):
        padded[4 * i], padded[4 * i + 1] = x[3 * i], x[3 * i + 1]
        padded[4 * i + 2], padded[4 * i + 3] = x[3 * i + 2], zero
