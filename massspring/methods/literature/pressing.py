"""Obstacles against a body that answers forces linearly: pushes and gaps, of which one is zero at every row (eq. 14.3).

The rows are the normals at touched nodes; the pushes solve a linear complementarity problem, as in Hauser, Shen,
O'Brien (2003) and in Pauly, Pai, Guibas (2004).
"""

from typing import NamedTuple, Protocol

import numpy as np
from scipy.linalg import cholesky, solve, solve_triangular
from scipy.optimize import nnls

from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.state import State
from massspring.methods.implicit.contact import Contact, TouchedRows

REVISIONS = 12
"""Of the touched set in one step; a node that would still enter is found in the next."""
PIVOTS = 20
"""Exchanges of whole blocks; where they go round in circles, one row after the other."""
SOFTNESS = 1e-11
"""Relative compliance of a row: fewer modes than rows leave a matrix without inverse."""
ROUND_OFF = 1e-12
"""Of the largest gap."""
CLOSER = 1e-9
"""Of the longest correction, 0.3 of an edge: a node this near to an obstacle begins a step on it."""


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
    """From where the step would end at without obstacles, `free` (n, 3) [m], to where it ends."""
    if not len(boundary.radius):
        return Pressed(free, None, np.zeros(0))
    model, nodes, contacts = state.model, state.nodes, state.contacts
    contact = Contact(model, nodes, contacts, boundary, step, CLOSER * model.correction_limit)
    for _ in range(REVISIONS):
        rows = TouchedRows(nodes, contacts, model.surface_nodes, boundary.dt)
        pushes = complementary(response.compliance(rows), rows.place - rows.along(free))
        end = free + response.moved(rows, pushes)
        if not contact.revise(end, rows, pushes):
            break
    return Pressed(end, rows, pushes)


def complementary(compliance: np.ndarray, missing: np.ndarray) -> np.ndarray:
    """f ≥ 0 with A f ≥ b and f·(A f − b) = 0, A = `compliance` (c, c), symmetric, b = `missing` (c,).

    By exchanges of all wrong rows at once (Kostreva 1978), and where those do not end by non-negative least squares.
    """
    if not len(missing):
        return missing
    matrix = compliance + SOFTNESS * compliance.diagonal().max() * np.eye(len(missing))
    if not np.isfinite(matrix).all():
        return np.full_like(missing, np.nan)  # numbers are lost: the run ends
    pressed, allowed = np.ones(len(missing), dtype=bool), -ROUND_OFF * np.abs(missing).max()
    for _ in range(PIVOTS):
        force = np.zeros_like(missing)
        force[pressed] = solve(matrix[np.ix_(pressed, pressed)], missing[pressed], assume_a="sym")
        wrong = np.where(pressed, force < 0.0, matrix @ force - missing < allowed)
        if not wrong.any():
            return force
        pressed ^= wrong
    root = cholesky(matrix)
    return nnls(root, solve_triangular(root, missing, trans=1))[0]
