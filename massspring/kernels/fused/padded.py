"""Positions padded to four numbers, as one move of memory fetches them."""

from massspring.kernels.jit.decorators import inlined
from massspring.kernels.jit.flat import flat


@inlined
def places_into(nodes, work, first, last):
    """The positions of some nodes in fours, as one move of memory fetches them, (n, 4)."""
    x, places = flat(nodes.x, first, last), flat(work.places, first, last)
    zero = nodes.x.dtype.type(0)
    for i in range(last - first):
        places[4 * i], places[4 * i + 1] = x[3 * i], x[3 * i + 1]
        places[4 * i + 2], places[4 * i + 3] = x[3 * i + 2], zero
