"""How a run ended: the rules behind the status of our own runs and of results that others hand in."""

import numpy as np

from massspring import History
from studies.runs.case import Case
from studies.runs.indicators import CROSSED, FEEDS, LESS, SHAKES, SWINGS, gained, swing, through_itself
from studies.scene.scene import Scene
from studies.store.schema import Status

DRIFT = 0.01
"""Relative volume error beyond which a method that keeps the volume has status "drifted": thirty times the error that
the weakest claim allows."""
FOLDED = 0.1
"""Least J below which an element is folded. A quadratic cylinder pressed between sliding planes folds at once, on seven
meshes at 36 to 41 % compression: its force is right within 1.5 % while least J is above 0.13, more than 3 % off where
it is below 0.1, at the latest a frame (0.1 % compression) later, and least J reaches 0. A good body may have small J at
the edge of a held region, where the strain has no bound: 0.13 in the catalogue (ball_clamped)."""


def status_of(case: Case, history: History, itself: float = float("nan")) -> tuple[Status, str]:
    """The status of a run, and a sentence on the reason; empty where it is ok. itself: see `crossed`."""
    if history.outcome != "finished":
        return Status(history.outcome), history.message
    start = case.scene.start
    reason = tunnelling(history.inside)
    if reason:
        return Status.TUNNELLED, reason
    status, reason = folding(history.min_j, shaped=start is not None and start.shaped)
    if status != Status.OK:
        return status, reason
    status, reason = shaking(case.scene, history)
    if status != Status.OK:
        return status, reason
    # For a body that starts with a volume error only the final volume counts.
    since = 0 if start is None else -1
    drift = float(np.max(np.abs(history.volume[since:] / history.volume_target[since:] - 1)))
    if case.method.volume_tol is not None and drift > DRIFT:
        return Status.DRIFTED, f"volume error {100 * drift:.3g} % (allowed: {100 * DRIFT:g} %)"
    return crossing(itself)


def crossing(itself: float) -> tuple[Status, str]:
    """Whether the body passed through itself, which where elements invert is a sequel; and a sentence on it."""
    return (Status.TUNNELLED, through_itself(itself)) if itself > CROSSED else (Status.OK, "")


def shaking(scene: Scene, history: History) -> tuple[Status, str]:
    """Whether a body gains energy that nothing gives it, as contact does that answers volumes a step late; and a
    sentence on it. Not seen where the work is unknown, and what damping takes at once is not counted."""
    fed, swings = gained(history), swing(scene, history)
    if not fed > (FEEDS if swings > SWINGS else SHAKES):
        return Status.OK, ""
    words = f", and it swings by {100 * swings:.2g} % at the end" if swings > SWINGS else ""
    return Status.SHAKEN, f"the body gains {100 * fed:.2g} % of its energy by itself{words}; {LESS}"


def tunnelling(inside: np.ndarray) -> str:
    """A sentence on the first obstacle with its middle inside the body in any frame (F, o); empty without one."""
    frames, obstacles = np.nonzero(inside)
    if not len(frames):
        return ""
    o = int(obstacles[0])
    count = int(np.count_nonzero(inside[:, o]))
    return (
        f"the middle of obstacle {o} is or was inside the body in {count} of {len(inside)} "
        "frames: it slipped through its surface; use more nodes there, or a quadratic body with graded='adaptive'"
    )


def folding(min_j: np.ndarray, shaped: bool) -> tuple[Status, str]:
    """Whether an element folds or inverts in any frame, by the least J of each (F,), NaN without elements (see
    History.min_j); and a sentence on it. Of linear elements, what happens within a frame is not seen.

    shaped: whether the body starts in a shape other than at rest. It may then be folded on its way back, so only the
    last frame counts.
    """
    counted = min_j[-1:] if shaped else min_j
    inverted = counted <= 0.0
    status, there = (Status.INVERTED, inverted) if inverted.any() else (Status.FOLDED, counted < FOLDED)
    if not there.any():
        return Status.OK, ""
    where = "at the end" if shaped else f"in {there.sum()} of {len(there)} frames"
    return status, f"an element is {status} {where} (least J {np.fmin.reduce(counted):.3g}; {FOLDED:g} is allowed)"
