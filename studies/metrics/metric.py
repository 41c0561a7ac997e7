"""A metric: name, meaning and function of a number computed from a run, and the quantity of the reference with which it
is compared."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from studies.metrics.run import Run
from studies.scene.quantities import ALWAYS, allowed
from studies.store.schema import COMPARABLE

PERCENT = 100.0
RESOLVED_SHARE = 0.1
"""An error is doubtful if the uncertainty of its reference is more than this share of it (docs/theory.md, the
reference)."""


@dataclass(frozen=True)
class Metric:
    """Name, meaning and function of a number, and the quantity of the reference with which it is compared."""

    name: str
    unit: str
    better: str
    """"lower", "higher", or "-" for a signed deviation."""
    of: Callable[[Run], float]
    quantity: str | None = None
    """Quantity of the reference: its uncertainty applies, and the scene must allow its comparison."""
    spread: Callable[[Run], float] | None = None
    """For a number that needs no reference: a function that returns its uncertainty, in its unit."""

    @property
    def description(self) -> str:
        return (self.of.__doc__ or "").strip().split("\n")[0]

    def __call__(self, run: Run) -> float:
        """The number; NaN where the run ended early, or its reference or timing is missing."""
        if run.record.status not in COMPARABLE or not self._allowed(run):
            return float("nan")
        with np.errstate(divide="ignore", invalid="ignore"):  # of a reference that is 0 nothing is relative
            return float(self.of(run))

    def uncertainty(self, run: Run) -> float:
        """Uncertainty of the reference in the metric's unit, or the spread of the number; NaN without one or if the
        scene does not allow the comparison."""
        if self.spread is not None:
            return float(self.spread(run))
        if self.quantity is None or run.reference is None or not self._allowed(run):
            return float("nan")
        return PERCENT * run.reference.total_uncertainty[self.quantity]

    def unresolved(self, run: Run) -> bool:
        """Whether the uncertainty of the reference is more than a tenth of the number."""
        uncertainty = self.uncertainty(run)
        return (
            uncertainty == uncertainty and self.quantity not in ALWAYS and uncertainty > RESOLVED_SHARE * abs(self(run))
        )

    def _allowed(self, run: Run) -> bool:
        if self.quantity is None or self.quantity in ALWAYS:
            return True
        return run.reference is not None and allowed(run.case.scene, self.quantity)


def compared(unit: str, better: str, quantity: str) -> Callable[[Callable[[Run], float]], Metric]:
    """Makes a function the metric of its name, wherever it is called: what needs a reference has no value without one,
    nor in a scene that does not allow the comparison."""
    return lambda of: Metric(of.__name__, unit, better, of, quantity)
