"""Limits on steps, memory and time of a run; a run beyond them is refused before it begins."""

import math

from massspring import Body, StepLimit
from studies.base.errors import StudyError

TIME_LIMIT = 600.0
"""Processor time after which a run is stopped [s], checked between frames: ten times the longest case of the
catalogue."""
MOST_STEPS = 1e8
"""Most steps of a run: a step takes a microsecond or more for any body."""
MOST_BYTES = 5e8
"""Most bytes that a run may record, or prepare for a frame: a hundred times those of the largest case of the
catalogue."""
LEAST_NS = 0.3
"""Lower bound of the time of a spring in a step [ns] on any processor."""
NUMBER = 8
"""Size of a number [bytes]."""


def check_size(duration: float, frames: int, dt: float, limit: StepLimit, body: Body, around: int) -> None:
    """Raises StudyError for a run with too many steps, too much memory, or too much time.

    duration, dt: [s]; around: obstacles and held regions.
    """
    if not math.isfinite(duration):
        raise StudyError(f"the duration is {duration} s; give a finite one")
    if not (dt > 0 and duration > 0 and frames >= 1):
        return  # make_clock reports it
    volumes, nodes = body.kept.count, body.node_count
    recorded = NUMBER * frames * (3 * volumes + 4 * around + 4)
    if recorded > MOST_BYTES:
        raise StudyError(
            f"frames = {frames} would record {recorded / 1e9:.2g} GB; at most {MOST_BYTES / 1e9:g} GB are: "
            "ask for fewer frames"
        )
    steps = max(float(frames), duration / dt)
    if steps > MOST_STEPS:
        raise StudyError(
            f"dt = {dt:.3g} s makes {steps:.1g} steps; at most {MOST_STEPS:.0g} are run: {_advice(dt, limit)}"
        )
    seconds = 1e-9 * LEAST_NS * steps * max(body.springs.count, nodes)
    if seconds > TIME_LIMIT:
        raise StudyError(
            f"dt = {dt:.3g} s makes {steps:.1g} steps of {body.springs.count:,} springs, at least "
            f"{seconds / 3600:.2g} hours; runs are stopped after {TIME_LIMIT:g} s: {_advice(dt, limit)}"
        )
    prepared = NUMBER * (steps / frames) * (volumes + 12 * around + 2)
    if prepared > MOST_BYTES:
        raise StudyError(
            f"dt = {dt:.3g} s makes {steps / frames:.1g} steps in a frame, whose paths take {prepared / 1e9:.2g} GB; "
            f"ask for more than {frames} frames"
        )


def _advice(dt: float, limit: StepLimit) -> str:
    if dt < 0.1 * limit.damped:
        return f"give dt near the limit of {limit.damped:.3g} s"
    return f"the stability limit is {limit.damped:.3g} s; lower the stiffness, or shorten the duration"
