"""The largest frequency of a spring network and the time step it allows (docs/theory.md, section 5)."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse import block_array, csr_array, diags_array, eye_array
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh, splu

from massspring.analysis.stiffness import stiffness_at_rest
from massspring.body.body import Body
from massspring.errors import MassSpringError

LANCZOS_TOLERANCE = 1e-4
"""Relative accuracy of ω²; far below 1 %, the accuracy to which the linear limit holds in a nonlinear run."""
SLOWEST_TOLERANCE, GIVES = 1e-2, 1e-2
"""Relative accuracy of ω_1², and compliance of kept volumes beside that of springs, about a bulk modulus of 100 mu:
with it the matrix needs no pivots, which takes a tenth of the time, and ω_1 is 0.3 % too low."""
RIGID = 1e10
"""Mean stiffness over mean mass and ω_1² from which ω_1 is round-off: meshes of 10,000 nodes have 1e6."""


def scaled_stiffness(body: Body, held_nodes: np.ndarray) -> csr_array:
    """M^-½ K M^-½ [1/s²] of the free nodes at rest, (3n, 3n); rows of held nodes are zero (eq. 5.1)."""
    root = 1.0 / np.sqrt(body.moved_mass)
    root[held_nodes] = 0.0
    scale = diags_array(np.repeat(root, 3))
    return csr_array(scale @ stiffness_at_rest(body) @ scale)


def largest_frequency(body: Body, held_nodes: np.ndarray | None = None, added: csr_array | None = None) -> float:
    """ω_max [1/s] of small oscillations about rest, by Lanczos iteration from a fixed start. Raises MassSpringError.

    `added` B (3n, r) [√(N/m)] is what a method adds to the springs: K + B Bᵀ (eq. 5.1).
    """
    held = np.empty(0, dtype=np.int64) if held_nodes is None else held_nodes
    matrix = scaled_stiffness(body, held)
    if added is not None:
        matrix = _with_added(matrix, body, held, added)
    start = np.random.default_rng(0).standard_normal(3 * body.node_count)
    try:
        largest = eigsh(matrix, 1, which="LA", v0=start, tol=LANCZOS_TOLERANCE, return_eigenvectors=False)[0]  # pyright: ignore[reportArgumentType]
    except ArpackError as error:
        raise MassSpringError(f"the largest frequency of the network did not converge: {error}") from error
    return math.sqrt(max(float(largest), 0.0))


def _with_added(matrix: csr_array, body: Body, held: np.ndarray, added: csr_array) -> LinearOperator:
    """M^-½ (K + B Bᵀ) M^-½ without forming B Bᵀ, which is full for a volume of the whole."""
    root = np.repeat(1.0 / np.sqrt(body.moved_mass), 3)
    root.reshape(-1, 3)[held] = 0.0
    factor = csr_array(added.multiply(root[:, None]))
    return LinearOperator(matrix.shape, matvec=lambda q: matrix @ q + factor @ (factor.T @ q), dtype=np.float64)  # pyright: ignore[reportCallIssue]


def slowest_frequency(body: Body, held_nodes: np.ndarray) -> float:
    """ω_1 [1/s], the smallest of small oscillations about rest with kept volumes, by Lanczos iteration on the inverse;
    0 if the held nodes leave a motion as a whole (eq. 5.5). Obstacles and loads are not known.

    K u − Jᵀ p = ω² M u, J u = −GIVES p is quasi-definite, so that it is factored symmetrically (Vanderbei 1995).
    """
    free = np.delete(np.arange(3 * body.node_count).reshape(-1, 3), held_nodes, axis=0).ravel()
    stiffness = csr_array(stiffness_at_rest(body)[free][:, free])
    rows = csr_array(body.kept.jacobian(body.rest)[:, free])
    level = float(stiffness.diagonal().mean())
    rows = rows * (level / np.abs(rows.data).mean())
    saddle = block_array([[stiffness, rows.T], [rows, -GIVES * level * eye_array(rows.shape[0])]])
    root, right = np.sqrt(np.repeat(body.moved_mass, 3)[free]), np.zeros(len(free) + rows.shape[0])
    start = np.random.default_rng(0).standard_normal(len(free))

    def inverse(q: np.ndarray) -> np.ndarray:
        right[: len(free)] = root * q.ravel()
        return root * factor.solve(right)[: len(free)]

    operator = LinearOperator((len(free), len(free)), matvec=inverse, dtype=np.float64)  # pyright: ignore[reportCallIssue]
    try:
        factor = splu(saddle.tocsc(), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        largest = float(eigsh(operator, 1, v0=start, tol=SLOWEST_TOLERANCE, return_eigenvectors=False)[0])  # pyright: ignore[reportArgumentType]
    except ArpackError as error:
        raise MassSpringError(f"the smallest frequency of the body did not converge: {error}") from error
    except RuntimeError as error:
        if "singular" not in str(error):
            raise
        return 0.0
    return math.sqrt(1.0 / largest) if 0.0 < largest * level < RIGID * float((root**2).mean()) else 0.0


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
        """(2/ω)(√(1 + ζ²) − ζ) [s] with ζ = c/(2ω) (eq. 5.2)."""
        zeta = self.damping / (2.0 * self.frequency)
        return self.undamped * (math.sqrt(1.0 + zeta * zeta) - zeta)


def step_limit(
    body: Body, damping: float = 0.0, held_nodes: np.ndarray | None = None, added: csr_array | None = None
) -> StepLimit:
    """Limit of a body with mass-proportional `damping` [1/s], with what a method adds to its springs.

    `added`: the method's `added_stiffness(body)`. Raises MassSpringError for a body without springs.
    """
    if not (math.isfinite(damping) and damping >= 0):
        raise MassSpringError(f"damping is {damping} 1/s; it must be zero or positive")
    held = np.asarray([] if held_nodes is None else held_nodes)
    if len(held) and not 0 <= held.min() <= held.max() < body.node_count:
        raise MassSpringError(f"nodes are numbered from 0 to {body.node_count - 1}; correct held_nodes")
    frequency = (
        largest_frequency(body, held_nodes, added) if body.springs.count or len(body.membrane.triangles) else 0.0
    )
    if not frequency > 0:
        raise MassSpringError("the body has no stiffness, so no largest frequency; give it springs or a dt in seconds")
    return StepLimit(frequency, damping)
