"""Moves nodes as far as their elements allow."""

from collections.abc import Callable

import numpy as np

from studies.base.errors import StudyError

FLOOR = 0.1
"""Smallest allowed measure of an element, 1 for an ideal one. Flatter elements would require a small time step."""
STEP = 0.1
"""Share of its motion by which a node moves back at a time."""

Measure = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Points (n, 3), elements (k, m) of them and their numbers (k,) -> a measure of quality, (k,): 1 for an undeformed
element, at most 0 for an inverted one."""


def retreat(safe: np.ndarray, target: np.ndarray, cells: np.ndarray, measure: Measure, name: str) -> np.ndarray:
    """Share of the way from `safe` to `target` (n, 3) [m] that each node can go, (n,).

    While the measure of an element of `cells` (k, m) is below FLOOR, or below its value at `safe` if that is less, one
    of its nodes moves back by a step: the one that improves the elements around it most, or all if none does. Raises
    StudyError for an element that is inverted at `safe`.
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
    """Improvement of the elements around a node if the node is at `place` (3,) [m]."""
    around = np.flatnonzero((cells == node).any(axis=1))
    trial = points.copy()
    trial[node] = place
    before, after = (np.exp(-measure(x, cells[around], around) / FLOOR).sum() for x in (points, trial))
    return float(before - after)
