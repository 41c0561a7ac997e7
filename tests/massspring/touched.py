"""Nodes that a test seats on obstacles by hand."""

import numpy as np

from massspring.kernels.layout import Motion


def list_touched(motion: Motion) -> None:
    """Lists the locked nodes, as the contact search does for those that it seats."""
    nodes = np.flatnonzero(motion.locked)
    motion.touching[: len(nodes)] = nodes
    motion.touching_count[0] = len(nodes)
