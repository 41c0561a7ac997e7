"""What takes long says what it does, and whoever waits for it hears that, in this process or from another."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Doing(str):
    """What a process does now, among the messages that it sends."""


Hear = Callable[[Doing], object]
HEARING: list[Hear] = []
"""Who hears what this process does."""


def doing(what: str) -> None:
    for hear in HEARING:
        hear(Doing(what))


@contextmanager
def hearing(hear: Hear) -> Iterator[None]:
    """Inside, `hear` is called with everything that this process begins, from any thread."""
    HEARING.append(hear)
    try:
        yield
    finally:
        HEARING.remove(hear)
