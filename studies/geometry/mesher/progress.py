"""Progress of the mesher: a line for each stage, from its process to the process that waits for it."""

import logging

WAITING = logging.getLogger("organbench.mesher")
"""Hears each stage in the process that waits, and every BEAT seconds how long it has taken."""
BEAT = 20.0
"""Seconds between two signs of life."""


def stage(what: str) -> None:
    """Reports the next stage in the mesher's process; the process that waits reads it from standard output."""
    print(what, flush=True)
