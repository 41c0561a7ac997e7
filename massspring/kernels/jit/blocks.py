"""Search for few nodes among many: a block of 64 nodes without a match is skipped at once."""

from massspring.kernels.jit.decorators import njit_inlined
from massspring.kernels.jit.flat import flat

BLOCK = 64
"""Nodes per block."""


@njit_inlined
def any_gap_within(gap, begin, reach):
    """Whether the block from `begin` on has a node with a gap of at most `reach` [m]; always true for a block that is
    not full.

    NaN counts as near.
    """
    if begin + BLOCK > gap.shape[0]:
        return True
    block, near = flat(gap, begin, begin + BLOCK), 0
    for i in range(BLOCK):
        near += not block[i] > reach
    return near > 0
