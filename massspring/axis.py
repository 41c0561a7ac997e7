"""The dominant axis of a surface and the virtual nodes on it, ends of the inner springs (JHC05, section 3)."""

import numpy as np

MIN_VIRTUAL_NODES = 2


def principal_axis(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centre [m] and unit direction of largest spread of `points` (n, 3), both (3,)."""
    centre = points.mean(axis=0)
    _, directions = np.linalg.eigh(np.cov((points - centre).T))
    return centre, directions[:, -1]


def virtual_nodes(points: np.ndarray, spacing: float) -> np.ndarray:
    """Nodes [m], (a, 3), evenly on the principal axis of `points` (n, 3) [m], about `spacing` [m] apart.

    The axis ends half a spacing inside the surface nodes' extent. The paper's axis follows "the organ's topology":
    a straight one serves a compact organ (ball, liver, spleen), not a bent one.
    """
    centre, direction = principal_axis(points)
    along = (points - centre) @ direction
    low, high = along.min(), along.max()
    count = max(MIN_VIRTUAL_NODES, round((high - low) / spacing) - 1)
    margin = (high - low) / (count + 1)
    positions = np.linspace(low + margin, high - margin, count)
    return centre + positions[:, None] * direction


def closest_virtual_node(points: np.ndarray, virtual: np.ndarray) -> np.ndarray:
    """Index into `virtual` (a, 3) of the node closest to each of `points` (n, 3), (n,)."""
    return np.argmin(((points[:, None, :] - virtual[None, :, :]) ** 2).sum(axis=2), axis=1)
