"""The one exception of this package, and the one warning."""


class SolveError(ValueError):
    """A reference problem that cannot be set up or solved; the message is one sentence for the user.

    `converged` holds the equilibria reached before a loading path stopped (empty for a bad set-up).
    """

    def __init__(self, message, converged=()):
        super().__init__(message)
        self.converged = list(converged)


class SlowSolverWarning(UserWarning):
    """The fast sparse factorisation is missing; answers are the same, only slower."""
