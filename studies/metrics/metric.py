"""How a number that is read off a run is called, what it means, and what it may be compared with."""

from collections.abc import Callable
from dataclasses import dataclass

from studies.metrics.run import Run
from studies.scene.quantities import ALWAYS, allowed
from studies.store.record import Status

PERCENT = 100.0
RESOLVED_SHARE = 0.1
"""An error with more than this share of uncertainty in it is doubtful (docs/theory.md, the reference)."""
COMPARABLE = (Status.OK, Status.INVERTED, Status.DRIFTED)
"""A run that ended early has no last checkpoint."""


@dataclass(frozen=True)
class Metric:
    """How a number is called, what it means, and what it may be compared with."""

    name: str
    unit: str
    better: str
    """"lower", "higher", or "-" where the sign says which way it is off."""
    of: Callable[[Run], float]
    quantity: str | None = None
    """Of the reference: the name of its floor, and what the scene must allow to be compared."""
    spread: Callable[[Run], float] | None = None
    """Of a number that needs no reference: how well it is known, in its unit."""

    @property
    def description(self) -> str:
        """First line of the function's docstring."""
        return (self.of.__doc__ or "").strip().split("\n")[0]

    def __call__(self, run: Run) -> float:
        """The number; NaN where the run ended early, or its reference or timing is missing."""
        if run.record.status not in COMPARABLE or not self._allowed(run):
            return float("nan")
        return float(self.of(run))

    def uncertainty(self, run: Run) -> float:
        """Uncertainty of the reference in the metric's unit, or the spread of the number; NaN without one or where
        nothing may be compared."""
        if self.spread is not None:
            return float(self.spread(run))
        if self.quantity is None or run.reference is None or not self._allowed(run):
            return float("nan")
        return PERCENT * run.reference.total_uncertainty[self.quantity]

    def unresolved(self, run: Run) -> bool:
        """Whether the reference is not ten times better than what it judges here."""
        uncertainty = self.uncertainty(run)
        return (
            uncertainty == uncertainty and self.quantity not in ALWAYS and uncertainty > RESOLVED_SHARE * abs(self(run))
        )

    def _allowed(self, run: Run) -> bool:
        """Whether there is something to compare with, and the scene says that it may be."""
        if self.quantity is None or self.quantity in ALWAYS:
            return True
        return run.reference is not None and allowed(run.case.scene, self.quantity)
