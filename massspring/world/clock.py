"""Frames and steps: results are recorded after each frame, and the method advances by steps."""

import math
from dataclasses import dataclass

import numpy as np

from massspring.analysis.stability import StepLimit
from massspring.errors import MassSpringError

AUTO_FRACTION = 0.5
"""dt = "auto" is this fraction of the stability limit."""


@dataclass(frozen=True)
class Clock:
    """F frames of equal length, each of `steps` equal steps, or of more where a load lowers the limit."""

    frame: float
    """Length of a frame [s]."""
    frames: int
    steps: int
    """Steps per frame."""
    limit: StepLimit | None = None
    """That of the body at rest: where a load lowers it too far, steps get shorter. None: they stay equal."""
    longest: float = math.inf
    """Longest step that was asked for [s], of which `dt` is the next that divides a frame."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.frame) and self.frame > 0):
            raise MassSpringError(f"a frame takes {self.frame} s; give a positive number")
        for name in ("frames", "steps"):
            value = getattr(self, name)
            if not isinstance(value, int | np.integer) or value < 1:
                raise MassSpringError(f"a clock has {name} = {value!r}; give a whole number from 1 on")

    @property
    def dt(self) -> float:
        """Time step [s]; never longer than the one asked for."""
        return self.frame / self.steps

    @property
    def duration(self) -> float:
        """[s]."""
        return self.frame * self.frames


def make_clock(duration: float, frames: int, dt: float | str, limit: StepLimit, beyond_limit: bool = False) -> Clock:
    """Frames that fill `duration` [s] exactly, with steps no longer than `dt` [s]; "auto": half the stability limit.

    Raises MassSpringError for dt ≤ 0, and for a dt above the limit unless that is wanted (`beyond_limit`).
    """
    if isinstance(dt, str):
        if dt != "auto":
            raise MassSpringError(f"dt is '{dt}'; give seconds or 'auto'")
        longest = AUTO_FRACTION * limit.damped
    else:
        longest = float(dt)
    if not (math.isfinite(longest) and longest > 0):
        raise MassSpringError(f"dt is {dt} s; it must be positive, the stability limit is {limit.damped:.3g} s")
    if frames < 1 or not 0 < duration < math.inf:
        raise MassSpringError(
            f"{frames} frames in {duration} s; a run needs at least one frame and a positive duration"
        )
    frame = duration / frames
    steps = max(1, math.ceil(frame / longest - 1e-9))
    clock = Clock(frame, frames, steps, None if beyond_limit else limit, longest)
    if clock.dt > limit.damped and not beyond_limit:
        raise MassSpringError(
            f"dt = {clock.dt:.3g} s lies above the stability limit of {limit.damped:.3g} s; "
            "take a smaller dt or 'auto', or set beyond_limit to see the run diverge"
        )
    return clock
