"""How a run ended: the rules behind the status of our own runs and of results that others hand in."""

import numpy as np

from massspring import History
from studies.runs.case import Case
from studies.store.schema import Status

DRIFT = 0.01
"""Relative volume error beyond which a method that keeps the volume has status "drifted": thirty times the error that
the weakest claim allows."""


def status_of(case: Case, history: History) -> tuple[Status, str]:
    """The status of a run, and a sentence on the reason; empty where it is ok."""
    if history.outcome != "finished":
        return Status(history.outcome), history.message
    status, reason = inversion(history.min_j)
    if status != Status.OK:
        return status, reason
    # For a body that starts with a volume error only the final volume counts.
    since = 0 if case.scene.start is None else -1
    drift = float(np.max(np.abs(history.volume[since:] / history.volume_target[since:] - 1)))
    if case.method.volume_tol is not None and drift > DRIFT:
        return Status.DRIFTED, f"volume error {100 * drift:.3g} % (allowed: {100 * DRIFT:g} %)"
    return Status.OK, ""


def inversion(min_j: np.ndarray) -> tuple[Status, str]:
    """Whether an element is inverted at the end, by the smallest volume ratio in each frame (F,), NaN without elements;
    and a sentence on it. What inverts on the way and recovers is not seen."""
    smallest = float(min_j[-1])
    if smallest <= 0.0:
        return Status.INVERTED, f"an element is inverted at the end (smallest volume ratio {smallest:.3g})"
    return Status.OK, ""
