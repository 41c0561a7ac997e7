"""Looking for the few among many: 64 nodes are passed over at once where none of them is meant."""

from massspring.kernels.jit.decorators import njit_inlined
from massspring.kernels.jit.flat import flat

BLOCK = 64
"""Nodes."""


@njit_inlined
def any_gap_within(gap, begin, reach):
    """Whether any node of the block is no farther than `reach` [m]; a block that is not full is always looked through.

    What is not a number counts as near.
    """
    if begin + BLOCK > gap.shape[0]:
        return True
    block, near = flat(gap, begin, begin + BLOCK), 0
    for i in range(BLOCK):
        near += not block[i] > reach
    return near > 0
