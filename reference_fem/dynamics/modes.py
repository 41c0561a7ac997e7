"""Natural frequencies and modes of a body about its rest shape (docs/theory.md, eq. 6.8)."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, eigsh

from reference_fem.dynamics.inertia import MovingSystem
from reference_fem.errors import SolveError
from reference_fem.model.problem import Problem
from reference_fem.system.checks import rigid_freedoms
from reference_fem.system.state import Loads, NewtonSettings


@dataclass(frozen=True, eq=False)
class Modes:
    """The lowest modes, ordered by frequency. The `rigid` motions that are not held come first, at (almost) zero."""

    omega: np.ndarray
    """Circular frequencies, (rigid + count,) [rad/s]."""
    shapes: np.ndarray
    """Displacements of the P2 nodes, (rigid + count, N2, 3) [1/√kg]: orthonormal in the mass."""
    rigid: int
    """Number of rigid motions: six for a free body, none for one that is held."""

    @property
    def elastic(self):
        """Circular frequencies without the rigid motions, (count,) [rad/s]."""
        return self.omega[self.rigid :]

    @property
    def frequencies(self):
        """Elastic frequencies, (count,) [Hz]."""
        return self.elastic / (2.0 * np.pi)


def natural_frequencies(problem: Problem, count: int, solver: str = "auto") -> Modes:
    """The `count` lowest elastic modes of the undeformed, stress-free body, and the rigid motions left free.

    K z = omega² diag(M, 0) z with the tangent K of P2/P1 at rest and the consistent mass M; the pressure has no
    inertia. Shift-invert Lanczos (Lehoucq, Sorensen, Yang, ARPACK Users' Guide, 1998) on the displacement alone: the
    pressure is eliminated by every solve. Prescribed displacements are held at zero; obstacles and loads are ignored,
    and lumens are empty. Raises SolveError for a body without mass and for a count that the mesh cannot give.
    """
    system = MovingSystem(replace(problem, obstacles=(), cavities=()), NewtonSettings(solver=solver))
    pattern, n = system.pattern, system.displacement_count
    free = pattern.free[pattern.free < n]
    rigid = rigid_freedoms(system.nodes, pattern.held).shape[1]
    if not 1 <= count < len(free) - rigid:
        raise SolveError(f"{count} modes are asked for: give 1 to {len(free) - rigid - 1}, refine for more")
    try:
        values, vectors = lowest(system, free, rigid + count)
    finally:
        system.solver.release()
    shapes = np.zeros((rigid + count, n))
    shapes[:, free] = vectors.T
    # round-off leaves a rigid motion's omega² at either side of zero
    return Modes(np.sqrt(np.maximum(values, 0.0)), shapes.reshape(len(shapes), -1, 3), rigid)


def lowest(system: MovingSystem, free: np.ndarray, count: int):
    """The count smallest omega² (ascending) and their modes (len(free), count) on the free displacements."""
    problem, mass = system.problem, system.mass
    rest = system.rest()
    tangent = system.evaluate(rest.x, Loads(0.0, system.rows, rest.multiplier)).values
    # a negative shift, so that a free body can be factorised; its size is about the lowest elastic omega² of a compact
    # body
    shift = -problem.material.mu / (problem.density * system.volume ** (2.0 / 3.0))
    system.solver.factor(system.pattern.upper(tangent - shift * mass.values))
    unknowns, displacements = len(system.pattern.free), len(free)

    def inverse(force: np.ndarray):
        """Displacement under a force at the shifted stiffness: the pressures follow and are dropped."""
        right = np.zeros(unknowns)
        right[:displacements] = force
        return system.solver.solve(right)[:displacements]

    shape = (displacements, displacements)
    apart = sp.kron(mass.matrix, sp.identity(3), format="csr")[free][:, free]
    operator = LinearOperator(shape, matvec=inverse, dtype=float)  # pyright: ignore[reportCallIssue]
    start = np.random.default_rng(0).standard_normal(displacements)
    basis = min(displacements, 3 * count + 20)
    values, vectors = eigsh(operator, count, M=apart, sigma=shift, OPinv=operator, v0=start, ncv=basis)
    order = np.argsort(values)
    return values[order], vectors[:, order]
