"""Nodes moved as far as their elements allow."""

from collections.abc import Callable

import numpy as np

from studies.base.errors import StudyError

FLOOR = 0.1
"""Of what an upright element has: elements below it take nodes back. Flatter ones force a small time step."""
STEP = 0.1
"""Of a move, that a node takes back at a time."""

Measure = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Points (n, 3), elements (k, m) of them and their numbers (k,) -> how upright they are, (k,): 1 for one that is as at
rest, at most 0 for one inside out."""


def retreat(safe: np.ndarray, target: np.ndarray, cells: np.ndarray, measure: Measure, name: str) -> np.ndarray:
    """Share of the way from `safe` to `target` (n, 3) [m] that each node can go, (n,).

    While an element of `cells` (k, m) is below FLOOR, or below what it is at `safe` if that is less, one of its nodes
    takes a step back: the one that helps the elements around it most, or all where none helps. Raises StudyError for an
    element that is not upright at `safe` already.
    """
    every = np.arange(len(cells))
    at_rest = measure(safe, cells, every)
    worst = int(at_rest.argmin())
    if at_rest[worst] <= 0.0:
        place = ", ".join(f"{1e3 * x:.1f}" for x in safe[cells[worst]].mean(axis=0))
        raise StudyError(f"{name}: the element at ({place}) mm is flat or inverted; use more nodes, or mesh again")
    floor = np.minimum(FLOOR, (1.0 - 1e-9) * at_rest)
    way, share = target - safe, np.ones(len(safe))
    while True:
        points = safe + share[:, None] * way
        low = np.flatnonzero(measure(points, cells, every) < floor)
        if not len(low):
            return share
        for element in low:
            if measure(points, cells[[element]], np.array([element]))[0] >= floor[element]:
                continue  # the step of a neighbour was enough
            nodes = cells[element][(share[cells[element]] > 0.0) & way[cells[element]].any(axis=1)]
            places = safe[nodes] + np.maximum(share[nodes] - STEP, 0.0)[:, None] * way[nodes]
            gains = [_gain(points, int(node), place, cells, measure) for node, place in zip(nodes, places, strict=True)]
            chosen = nodes if not len(gains) or max(gains) <= 0.0 else nodes[[int(np.argmax(gains))]]
            share[chosen] = np.maximum(share[chosen] - STEP, 0.0)
            share[share < 0.5 * STEP] = 0.0
            points[chosen] = safe[chosen] + share[chosen, None] * way[chosen]


def _gain(points: np.ndarray, node: int, place: np.ndarray, cells: np.ndarray, measure: Measure) -> float:
    """How much the elements around a node are better for the node at `place` (3,) [m]."""
    around = np.flatnonzero((cells == node).any(axis=1))
    trial = points.copy()
    trial[node] = place
    before, after = (np.exp(-measure(x, cells[around], around) / FLOOR).sum() for x in (points, trial))
    return float(before - after)
