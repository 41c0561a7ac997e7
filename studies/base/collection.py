"""Building very many small objects at once without looking again and again for cycles among them."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def uncollected() -> Iterator[None]:
    """Inside, cycles wait: the collector would visit all objects each time that their number has grown by a quarter.
    For a function that makes hundreds of thousands which it keeps; as a decorator too."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
