"""Newton's method with a line search on an NGSolve form. Contact needs the line search, which NGSolve's Newton solver
lacks."""

from typing import Any

import numpy as np

from reference_fem.errors import SolveError

TOLERANCE = 1e-9
"""Residual of the free unknowns over the forces on the held ones and on the obstacles."""
MOST, HALVES = 40, 6
INVERSE = "sparsecholesky"
"""NGSolve's factorisation of symmetric matrices, definite or indefinite."""


def free_size(residual: np.ndarray, free: np.ndarray) -> float:
    """Norm of a residual's free part, infinite where it is not finite."""
    size = float(np.linalg.norm(residual[free]))
    return size if np.isfinite(size) else np.inf


class Newton:
    """A form, the state that makes it stationary, and which unknowns are free.

    form: an NGSolve BilinearForm made of Variation terms; state: its GridFunction; free: an NGSolve BitArray.
    """

    def __init__(self, form: Any, state: Any, free: Any):
        self.form, self.state, self.free = form, state, free
        self.chosen = np.fromiter(free, dtype=bool, count=len(free))
        self.work = state.vec.CreateVector()

    def residual(self) -> np.ndarray:
        """Derivative of the potential at the state, all unknowns."""
        self.form.Apply(self.state.vec, self.work)
        return self.work.FV().NumPy().copy()

    def step(self, right: Any) -> Any:
        """Tangent solve of a right-hand side, on the free unknowns."""
        return (self.form.mat.Inverse(self.free, inverse=INVERSE) * right).Evaluate()

    def lift(self, increment: np.ndarray) -> None:
        """The prescribed increment (all unknowns, 0 if free) plus the response of the free unknowns by the tangent."""
        vec = self.state.vec
        self.form.AssembleLinearization(vec)
        moved = vec.CreateVector()
        moved.FV().NumPy()[:] = increment
        pulled = (self.form.mat * moved).Evaluate()
        vec.data += moved
        vec.data -= self.step(pulled)

    def converge(self, scale: float) -> int:
        """Iterates until the free residual is TOLERANCE of `scale` [unit of the residual]; returns the number of
        iterations.

        Raises SolveError if it takes more than MOST iterations.
        """
        size = free_size(self.residual(), self.chosen)
        for iteration in range(MOST):
            if size <= TOLERANCE * scale:
                return iteration
            size = self._iterate(size)
        raise SolveError(f"NGSolve's residual is {size:.3g} after {MOST} iterations: take shorter steps")

    def _iterate(self, size: float) -> float:
        vec = self.state.vec
        self.form.AssembleLinearization(vec)
        self.form.Apply(vec, self.work)
        direction, before, share = self.step(self.work), vec.CreateVector(), 1.0
        before.data = vec
        for _ in range(HALVES):
            vec.data = before - share * direction
            reached = free_size(self.residual(), self.chosen)
            if reached < size:
                break
            share *= 0.5
        return reached
