"""Progress of the mesher: its process prints a line for each stage, and the waiting process logs it."""

import logging

WAITING = logging.getLogger("organbench.mesher")
"""Logger of the waiting process: each stage, and every BEAT seconds how long it has taken."""
BEAT = 20.0
"""Time [s] between two messages during a stage."""


def stage(what: str) -> None:
    """Reports the next stage from the mesher; the waiting process reads it from standard output."""
    print(what, flush=True)
