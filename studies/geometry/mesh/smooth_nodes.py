"""Moves single nodes to positions where their worst tetrahedron is better."""

from collections.abc import Callable

import numpy as np

from studies.geometry.mesh.quality import tetrahedron_radius_ratio

ROUNDS = 12
REACH = (0.3, 0.1, 0.03)
"""Trial moves in fractions of the mean distance to the neighbours."""

Bring = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""(nodes (k,), points (k, 3) [m]) -> points (k, 3) [m]: projects onto the surface on which these nodes stay."""


def mend_nodes(
    points: np.ndarray, tetrahedra: np.ndarray, movable: np.ndarray, bring: Bring, least: float
) -> np.ndarray:
    """Points (n, 3) [m] after the movable nodes (n,) bool of tetrahedra below the radius ratio `least` moved, those of
    the worst first. Each node tries 26 directions with three lengths, is projected back onto its surface by `bring`,
    and takes the position where the worst of its tetrahedra is best, so the smallest ratio around a node never
    falls."""
    points = points.copy()
    trials = trial_moves(REACH)
    for _ in range(ROUNDS):
        ratio = tetrahedron_radius_ratio(points, tetrahedra)
        bad = np.flatnonzero(ratio < least)
        nodes = tetrahedra[bad[np.argsort(ratio[bad], kind="stable")]].ravel()
        nodes = nodes[movable[nodes]]
        nodes = nodes[np.sort(np.unique(nodes, return_index=True)[1])]
        moves = [move_node(points, tetrahedra, int(node), trials, bring) for node in nodes]
        if not any(moves):
            return points
    return points


def trial_moves(reaches: tuple[float, ...]) -> np.ndarray:
    """Moves, shape (26 r, 3), with each of r lengths towards the faces, edges and corners of a cube."""
    directions = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
    directions = directions[np.abs(directions).sum(axis=1) > 0]
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return np.concatenate([reach * directions for reach in reaches])


def move_node(points: np.ndarray, tetrahedra: np.ndarray, node: int, trials: np.ndarray, bring: Bring) -> bool:
    """Moves one node, in place, by the best of the trial moves (m, 3) [mean distances to its neighbours]; False if none
    is better than staying."""
    around = tetrahedra[(tetrahedra == node).any(axis=1)]
    neighbours = np.setdiff1d(around, node)
    scale = np.linalg.norm(points[neighbours] - points[node], axis=1).mean()
    places = bring(np.full(len(trials), node), points[node] + scale * trials)
    # One copy of the star per trial, evaluated in one call.
    corners = np.where((around == node)[None, :, :, None], places[:, None, None, :], points[around][None])
    stars = np.arange(4 * len(trials) * len(around)).reshape(-1, 4)
    worst = tetrahedron_radius_ratio(corners.reshape(-1, 3), stars).reshape(len(trials), -1).min(axis=1)
    best = int(worst.argmax())
    if worst[best] <= tetrahedron_radius_ratio(points, around).min() + 1e-3:
        return False
    points[node] = places[best]
    return True
