"""Nodes that a test seats on obstacles by hand."""

import numpy as np

from massspring.kernels.arrays.layout import Motion
from massspring.kernels.contact.modes import SLIDES


def list_touched(motion: Motion) -> None:
    """Lists the locked nodes, as the contact search does for those that it seats."""
    nodes = np.flatnonzero(motion.locked)
    motion.touching[: len(nodes)] = nodes
    motion.touching_count[0] = len(nodes)


def seat(motion: Motion, nodes: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Seats free nodes (c,) on one obstacle, with any normals; the speeds a along them that it asks for [m/s], (c,)."""
    normals = rng.normal(size=(len(nodes), 3))
    motion.normal[nodes] = normals / np.linalg.norm(normals, axis=1)[:, None]
    approach = 0.05 * rng.normal(size=len(nodes))
    motion.touched[nodes], motion.locked[nodes] = 1, SLIDES
    motion.direction[nodes] = motion.normal[nodes]
    motion.goal[nodes] = approach[:, None] * motion.normal[nodes]
    list_touched(motion)
    return approach
