"""Back-solves with a sparse factor A = L D Lᵀ, three right-hand sides at once: the components of a field."""

from typing import NamedTuple

import numpy as np

from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import njit_lean


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
    start, row, value, node, z = factor.start, factor.row, factor.value, factor.node, factor.scratch
    moved[:] = 0.0
    for j in range(node.shape[0]):
        i = node[j]
        z[j, 0], z[j, 1], z[j, 2] = force[i, 0], force[i, 1], force[i, 2]
    for j in range(node.shape[0]):
        a0, a1, a2 = z[j, 0], z[j, 1], z[j, 2]
        for e in range(start[j], start[j + 1]):
            i, share = row[e], value[e]
            z[i, 0] -= share * a0
            z[i, 1] -= share * a1
            z[i, 2] -= share * a2
    for j in range(node.shape[0] - 1, -1, -1):
        pivot = factor.inverse_pivot[j]
        a0, a1, a2 = pivot * z[j, 0], pivot * z[j, 1], pivot * z[j, 2]
        for e in range(start[j], start[j + 1]):
            i, share = row[e], value[e]
            a0 -= share * z[i, 0]
            a1 -= share * z[i, 1]
            a2 -= share * z[i, 2]
        z[j, 0], z[j, 1], z[j, 2] = a0, a1, a2
        i = node[j]
        moved[i, 0], moved[i, 1], moved[i, 2] = a0, a1, a2
