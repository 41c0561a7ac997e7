"""A short timing by the timing protocol: the first frames of a case, as many as a few seconds allow."""

import warnings
from dataclasses import dataclass
from time import perf_counter

from massspring import MassSpringError
from studies.base.errors import StudyError
from studies.metrics.timing.cases import REPEATS
from studies.metrics.timing.protocol import FrameTiming, interleave, pinned
from studies.metrics.timing.stage_cost import run_frames
from studies.runs.case import Case
from studies.runs.prepare import prepare

SECONDS = 12.0
"""Computing time [s], without compiling and meshing."""
PROBED = 3
"""Frames from which the time of the others is estimated."""


@dataclass(frozen=True, eq=False)
class ShortTiming:
    """Frame times of the first frames of a case."""

    timing: FrameTiming
    frame: float
    """Simulated time of a frame [s]."""
    frames: int
    dt: float
    """[s]."""

    @property
    def covered(self) -> float:
        """Simulated time that was timed [s]."""
        return self.frames * self.frame


def short_timing(case: Case, seconds: float = SECONDS) -> ShortTiming:
    """Times the first frames on one pinned core, REPEATS times after a warm-up, within about `seconds`.

    Raises StudyError for a case that cannot be prepared, or breaks off.
    """
    try:
        with warnings.catch_warnings(), pinned(threads=1) as core:
            warnings.simplefilter("ignore", UserWarning)
            setup = prepare(case).setup
            clock, start = setup.clock, setup.start()
            run_frames(setup, start, frames=1)  # compiles
            begin = perf_counter()
            run_frames(setup, start, frames=min(PROBED, clock.frames))
            each = (perf_counter() - begin) / min(PROBED, clock.frames)
            frames = max(1, min(clock.frames, int(seconds / (REPEATS + 1) / each)))
            measured = interleave({case.name: lambda: run_frames(setup, start, frames=frames)[0]}, REPEATS, core=core)
    except MassSpringError as error:
        raise StudyError(f"{case.name} cannot be timed here: {error}") from error
    return ShortTiming(measured[case.name], clock.frame, frames, clock.dt)
