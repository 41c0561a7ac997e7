"""The largest frequency of a spring network and the time step it allows (docs/theory.md, section 3)."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.linalg import ArpackError, eigsh

from massspring.body import Body
from massspring.errors import MassSpringError

LANCZOS_TOLERANCE = 1e-4
"""Relative accuracy of ω²; far below the 1 % to which a nonlinear run knows its limit."""


def scaled_stiffness(body: Body, held_nodes: np.ndarray) -> csr_array:
    """M^-½ K M^-½ [1/s²] of the free nodes at rest, (3n, 3n); rows of held nodes are zero (eq. 16)."""
    i, j = body.springs.ends.astype(np.int64).T
    direction = body.rest[j] - body.rest[i]
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    block = body.springs.stiffness[:, None, None] * direction[:, :, None] * direction[:, None, :]
    root = 1.0 / np.sqrt(body.mass)
    root[held_nodes] = 0.0
    axis = np.arange(3)
    rows, columns, values = [], [], []
    for a, b, sign in ((i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)):
        rows.append(np.broadcast_to(3 * a[:, None, None] + axis[None, :, None], block.shape).ravel())
        columns.append(np.broadcast_to(3 * b[:, None, None] + axis[None, None, :], block.shape).ravel())
        values.append((sign * (root[a] * root[b])[:, None, None] * block).ravel())
    shape = (3 * body.node_count, 3 * body.node_count)
    return coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape).tocsr()


def largest_frequency(body: Body, held_nodes: np.ndarray | None = None) -> float:
    """ω_max [1/s] of small oscillations about rest, by Lanczos iteration from a fixed start. Raises MassSpringError."""
    held = np.empty(0, dtype=np.int64) if held_nodes is None else held_nodes
    matrix = scaled_stiffness(body, held)
    start = np.random.default_rng(0).standard_normal(3 * body.node_count)
    try:
        largest = eigsh(matrix, 1, which="LA", v0=start, tol=LANCZOS_TOLERANCE, return_eigenvectors=False)[0]  # pyright: ignore[reportArgumentType]
    except ArpackError as error:
        raise MassSpringError(f"the largest frequency of the network did not converge: {error}") from error
    return math.sqrt(max(float(largest), 0.0))


@dataclass(frozen=True)
class StepLimit:
    """The stability limit of symplectic Euler with viscous damping at the old velocity."""

    frequency: float
    """ω_max [1/s]."""
    damping: float
    """c [1/s]."""

    @property
    def undamped(self) -> float:
        """dt_c = 2/ω_max [s]; the volume constraint does not lower it (Cauchy interlacing)."""
        return 2.0 / self.frequency

    @property
    def damped(self) -> float:
        """(2/ω)(√(1 + ζ²) − ζ) [s] with ζ = c/(2ω) (eq. 17)."""
        zeta = self.damping / (2.0 * self.frequency)
        return self.undamped * (math.sqrt(1.0 + zeta * zeta) - zeta)


def step_limit(body: Body, damping: float = 0.0, held_nodes: np.ndarray | None = None) -> StepLimit:
    """Limit of a body with mass-proportional `damping` [1/s]. Raises MassSpringError for a body without springs."""
    frequency = largest_frequency(body, held_nodes) if body.springs.count else 0.0
    if not frequency > 0:
        raise MassSpringError("the body has no stiffness, so no largest frequency; give it springs or a dt in seconds")
    return StepLimit(frequency, damping)
