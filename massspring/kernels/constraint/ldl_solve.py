"""Back-solves with a sparse factor A = L D Lᵀ, three right-hand sides at once: the components of a field."""

from typing import NamedTuple

import numpy as np

from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.jit.vec3 import minus, put, row, take_from, times


@by_address
class Triangular(NamedTuple):
    """L without its unit diagonal, column by column, and D, of the q nodes that respond among n."""

    start: np.ndarray
    """First entry of each column, (q + 1,) uint32."""
    row: np.ndarray
    """(e,) uint32."""
    value: np.ndarray
    """L [1], (e,)."""
    inverse_pivot: np.ndarray
    """1/D [1/kg], (q,)."""
    node: np.ndarray
    """Which node each column belongs to, (q,) uint32."""
    scratch: np.ndarray
    """(q, 4); rows of four lie side by side without a gap."""


@njit_lean
def respond_into(factor, force, moved):
    """A⁻¹ F, (n, 3): forward with L, then with D and back with Lᵀ; nodes without a column do not move (eq. 12.1)."""
    start, below, value, node, z = factor.start, factor.row, factor.value, factor.node, factor.scratch
    moved[:] = 0.0
    for j in range(node.shape[0]):
        put(z, j, row(force, node[j]))
    for j in range(node.shape[0]):
        a = row(z, j)
        for e in range(start[j], start[j + 1]):
            take_from(z, below[e], times(value[e], a))
    for j in range(node.shape[0] - 1, -1, -1):
        a = times(factor.inverse_pivot[j], row(z, j))
        for e in range(start[j], start[j + 1]):
            a = minus(a, times(value[e], row(z, below[e])))
        put(z, j, a)
        put(moved, node[j], a)
