"""The exceptions of this package, and its only warning."""

from collections.abc import Sequence
from typing import Any


class SolveError(ValueError):
    """A reference problem that cannot be set up or solved; the message is one sentence for the user.

    `converged` holds the equilibria reached before a loading path stopped (empty for a bad set-up).
    """

    def __init__(self, message: str, converged: Sequence[Any] = ()):
        super().__init__(message)
        self.converged = list(converged)


class SingularTangent(SolveError):
    """A tangent that cannot be factorised or solved with: the body is free to move, or a step went too far."""


class SlowSolverWarning(UserWarning):
    """The fast sparse factorisation is missing; results are the same, but take longer."""
