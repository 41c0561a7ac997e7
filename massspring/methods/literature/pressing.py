"""Obstacles against a body that answers forces linearly: pushes and gaps, of which one is zero at every row (eq. 14.3).

The rows are the normals at touched nodes; the pushes solve a linear complementarity problem, as in Hauser, Shen,
O'Brien (2003) and in Pauly, Pai, Guibas (2004).
"""

from typing import NamedTuple, Protocol

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, cholesky, solve_triangular

from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.state import State
from massspring.methods.implicit.contact import Contact, TouchedRows

REVISIONS = 12
"""Of the touched set in one step; a node that would still enter is found in the next."""
PASSES, SETTLED = 6, 1e-6
"""Along round obstacles, whose rows lie where the last pass ended: at most, and motion over the longest correction, 0.3
of an edge, after which none is made."""
PIVOTS = 20
"""Exchanges of whole blocks; where they go round in circles, one row after the other."""
SOFTNESS = 1e-11
"""Relative compliance of a row where fewer modes than rows leave a matrix without inverse."""
RESOLVED = 1e-10
"""Of the largest gap: what a solve of rows that do not depend on each other leaves at most."""
ROUND_OFF = 1e-12
"""Of the largest gap."""


class Response(Protocol):
    """How the body answers unit forces along rows in a step."""

    def compliance(self, rows: TouchedRows) -> np.ndarray:
        """How far row b moves along its direction by 1 N along row a [m/N], symmetric, (c, c)."""
        ...

    def moved(self, rows: TouchedRows, pushes: np.ndarray) -> np.ndarray:
        """Displacement by `pushes` (c,) [N] along the rows of the last `compliance` [m], (n, 3)."""
        ...


class Pressed(NamedTuple):
    """How a step ends on the obstacles."""

    end: np.ndarray
    """[m], (n, 3)."""
    rows: TouchedRows | None
    """None without obstacles."""
    pushes: np.ndarray
    """[N], (c,), none negative."""

    def book(self, boundary: BoundaryConditions, impulse: np.ndarray) -> None:
        """Adds what obstacles give in the step to `impulse` (o, 3) [N s]."""
        if self.rows is not None:
            given = boundary.dt * self.pushes[:, None] * self.rows.direction
            np.add.at(impulse, self.rows.obstacle, given)


def press(state: State, boundary: BoundaryConditions, step: int, free: np.ndarray, response: Response) -> Pressed:
    """From where the step would end without obstacles, `free` (n, 3) [m], to where it ends."""
    if not len(boundary.radius):
        return Pressed(free, None, np.zeros(0))
    model, nodes, contacts = state.model, state.nodes, state.contacts
    contact = Contact(model, nodes, contacts, boundary, step)
    for _ in range(REVISIONS):
        rows = TouchedRows(nodes, contacts, model.surface_nodes, boundary.dt)
        compliance = response.compliance(rows)
        for _ in range(PASSES):
            pushes = complementary(compliance, rows.place - rows.along(free))
            end = free + response.moved(rows, pushes)
            if not turn_places(rows, end, boundary, step) > SETTLED * model.correction_limit:
                break
        if not contact.revise(end, rows, pushes):
            break
    return Pressed(end, rows, pushes)


def turn_places(rows: TouchedRows, end: np.ndarray, boundary: BoundaryConditions, step: int) -> float:
    """Puts the places of rows at round obstacles where nodes that end at `end` (n, 3) would leave them along their
    directions (eq. 3.7); how far the farthest is moved [m]."""
    obstacle, direction = rows.obstacle, rows.direction
    span, centre = boundary.span[obstacle], boundary.position[step, obstacle]
    square = np.einsum("ci,ci->c", span, span)
    share = np.einsum("ci,ci->c", end[rows.nodes] - centre, span) / np.where(square > 0.0, square, 1.0)
    centre = centre + np.clip(share, 0.0, 1.0)[:, None] * span
    seen = end[rows.nodes] - centre
    along = np.einsum("ci,ci->c", seen, direction)
    below = boundary.radius[obstacle] ** 2 - (np.einsum("ci,ci->c", seen, seen) - along**2)
    meets = ~boundary.is_plane[obstacle] & (below > 0.0) & (along > 0.0)
    place = np.einsum("ci,ci->c", centre, direction) + np.sqrt(np.where(meets, below, 0.0))
    moved = np.where(meets, place - rows.place, 0.0)
    rows.place = rows.place + moved
    return float(np.abs(moved).max(initial=0.0))


def complementary(compliance: np.ndarray, missing: np.ndarray) -> np.ndarray:
    """f ≥ 0 with A f ≥ b and f·(A f − b) = 0, A = `compliance` (c, c), symmetric, b = `missing` (c,).

    By exchanges of all wrong rows at once (Kostreva 1978). Where those do not end, or rows depend on each other, by
    non-negative least squares with a little softness.
    """
    if not len(missing):
        return missing
    if not (np.isfinite(compliance).all() and np.isfinite(missing).all()):
        return np.full_like(missing, np.nan)  # numbers are lost: the run ends
    forces = exchanged(compliance, missing)
    if forces is not None:
        return forces
    root = cholesky(compliance + SOFTNESS * compliance.diagonal().max() * np.eye(len(missing)))
    from scipy.optimize import nnls  # 0.15 s that every command would wait for

    return nnls(root, solve_triangular(root, missing, trans=1))[0]


def exchanged(compliance: np.ndarray, missing: np.ndarray) -> np.ndarray | None:
    """The same by exchanges; None where they find nothing."""
    pressed, allowed = np.ones(len(missing), dtype=bool), ROUND_OFF * np.abs(missing).max()
    for _ in range(PIVOTS):
        force = np.zeros_like(missing)
        try:
            factor = cho_factor(compliance[np.ix_(pressed, pressed)])
        except LinAlgError:  # rows depend on each other
            return None
        force[pressed] = cho_solve(factor, missing[pressed])
        gap = compliance @ force - missing
        if np.abs(gap[pressed]).max(initial=0.0) > RESOLVED * np.abs(missing).max():
            return None
        wrong = np.where(pressed, force < 0.0, gap < -allowed)
        if not wrong.any():
            return force
        pressed ^= wrong
    return None
