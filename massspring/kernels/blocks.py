"""Looking for the few among many: 64 nodes are passed over at once where none of them is meant."""

from massspring.kernels.compiled import inlined

BLOCK = 64
"""Nodes."""


@inlined
def any_locked(locked, begin):
    """Whether an obstacle holds any node of the block; a block that is not full is always looked through."""
    if begin + BLOCK > locked.shape[0]:
        return True
    found = False
    for i in range(begin, begin + BLOCK):
        found |= locked[i] > 0
    return found
