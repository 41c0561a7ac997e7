"""Contact of obstacles with a body that responds linearly to forces: at every row the contact force or the gap is zero
(eq. 14.3).

The rows are the normals at touched nodes; the contact forces (`pushes`) solve a linear complementarity problem, as in
Hauser, Shen, O'Brien (2003) and in Pauly, Pai, Guibas (2004).
"""

from typing import NamedTuple, Protocol

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, cholesky, solve_triangular

from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.state import State
from massspring.methods.implicit.contact import Contact, TouchedRows

REVISIONS = 12
"""Most revisions of the touched set in one step; the next step finds nodes that would still enter."""
PASSES, SETTLED = 6, 1e-6
"""Passes over spheres and capsules, whose rows depend on where the last pass ended: the most passes, and the motion,
over the correction limit of 0.3 of an edge, at which they end."""
PIVOTS = 20
"""Most exchanges of all wrong rows at once."""
SOFTNESS = 1e-11
"""Relative compliance added to a row if the matrix is singular, since there are fewer modes than rows."""
RESOLVED = 1e-10
"""Residual, over the largest gap, up to which a solve with independent rows counts as accurate."""
ROUND_OFF = 1e-12
"""Round-off of a gap, over the largest gap."""


class Response(Protocol):
    """Protocol for the response of a body to unit forces along rows in a step."""

    def compliance(self, rows: TouchedRows) -> np.ndarray:
        """How far row b moves along its direction by 1 N along row a [m/N], symmetric, (c, c)."""
        ...

    def moved(self, rows: TouchedRows, pushes: np.ndarray) -> np.ndarray:
        """Displacement by `pushes` (c,) [N] along the rows of the last `compliance` [m], (n, 3)."""
        ...


class Pressed(NamedTuple):
    """The end of a step with contact."""

    end: np.ndarray
    """Positions [m], (n, 3)."""
    rows: TouchedRows | None
    """None without obstacles."""
    pushes: np.ndarray
    """Contact forces along the rows [N], (c,), none negative."""

    def book(self, boundary: BoundaryConditions, impulse: np.ndarray) -> None:
        """Adds the impulses of obstacles in the step to `impulse` (o, 3) [N s]."""
        if self.rows is not None:
            given = boundary.dt * self.pushes[:, None] * self.rows.direction
            np.add.at(impulse, self.rows.obstacle, given)


def press(state: State, boundary: BoundaryConditions, step: int, free: np.ndarray, response: Response) -> Pressed:
    """The end of the step with contact, from `free` (n, 3) [m], its end without obstacles."""
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
    """Updates the places of rows at spheres and capsules for nodes that end at `end` (n, 3) [m]: on the surface along
    the direction of the row (eq. 3.7). Returns the largest change [m]."""
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

    Solved by exchanges of all wrong rows at once (Kostreva 1978). If those do not end, or rows depend on each other, by
    non-negative least squares with the compliance SOFTNESS.
    """
    if not len(missing):
        return missing
    if not (np.isfinite(compliance).all() and np.isfinite(missing).all()):
        return np.full_like(missing, np.nan)  # not finite: the run ends
    forces = exchanged(compliance, missing)
    if forces is not None:
        return forces
    root = cholesky(compliance + SOFTNESS * compliance.diagonal().max() * np.eye(len(missing)))
    from scipy.optimize import nnls  # the import takes 0.15 s, for which every command would wait

    return nnls(root, solve_triangular(root, missing, trans=1))[0]


def exchanged(compliance: np.ndarray, missing: np.ndarray) -> np.ndarray | None:
    """The same by exchanges only; None if they find no solution."""
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
