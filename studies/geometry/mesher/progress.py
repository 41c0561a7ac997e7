"""What the mesher is at: a line for each stage, from its process to whoever waits for it."""

import logging

WAITING = logging.getLogger("organbench.mesher")
"""Hears each stage in the process that waits, and every BEAT seconds how long it has taken."""
BEAT = 20.0
"""Seconds between two signs of life."""


def stage(what: str) -> None:
    """Says in the mesher's process what comes next; the process that waits reads it from standard output."""
    print(what, flush=True)
