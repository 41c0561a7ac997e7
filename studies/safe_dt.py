"""The largest time step of a scene: predicted from the largest frequency, then tried just below and just above it."""

import warnings
from dataclasses import dataclass

from massspring import StepLimit
from studies.adapt import prepare
from studies.case import Case
from studies.run import measure
from studies.store import Status

BELOW, ABOVE = 0.95, 1.10
"""Fractions of the predicted limit that are run. Contact and large strain move the true limit by a few per cent."""


@dataclass(frozen=True)
class SafeStep:
    """A predicted limit and what happened on either side of it."""

    limit: StepLimit
    auto: float
    """The step that dt = "auto" takes [s]."""
    tried: tuple[tuple[float, Status], ...]
    """(time step [s], how the run ended)."""

    @property
    def verified(self) -> bool:
        """Whether the run below did not diverge and the one above did."""
        below, above = (status for _, status in self.tried)
        return below != Status.DIVERGED and above == Status.DIVERGED


def safe_step(case: Case) -> SafeStep:
    """Predicts and verifies. Raises StudyError or MassSpringError for a case that cannot be prepared."""
    prepared = prepare(case)
    limit, auto = prepared.limit, prepared.setup.clock.dt
    tried = []
    for fraction in (BELOW, ABOVE):
        wanted = fraction * limit.damped
        # One frame holds many steps, so that rounding to whole steps cannot carry the step across the limit.
        frames = max(1, int(case.scene.duration / (100 * wanted)))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # above the limit is the point of the second run
            record = measure(case.replaced(dt=wanted, frames=frames))
        tried.append((float(record.attributes.get("dt", wanted)), record.status))
    return SafeStep(limit, auto, tuple(tried))
