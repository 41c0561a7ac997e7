"""One command at a time measures on a results folder: two at once would slow each other down."""

import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

try:
    import fcntl
except ImportError:  # not on POSIX: a second command is not kept waiting there
    fcntl = None


@contextmanager
def alone(root: Path, waits: Callable[[], object] = lambda: None) -> Iterator[None]:
    """Inside, no other command that asks for the same folder. `waits` is called first where another is inside.

    A lock of the system: it is free again as soon as its process is gone. Warns where the disk knows no locks.
    """
    path = root / "cache" / "timing.lock"
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT)
    try:
        _lock(descriptor, path, waits)
        yield
    finally:
        os.close(descriptor)


def _lock(descriptor: int, path: Path, waits: Callable[[], object]) -> None:
    if fcntl is None:
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        waits()
        fcntl.flock(descriptor, fcntl.LOCK_EX)
    except OSError as error:
        warnings.warn(
            f"{path} cannot be locked ({error.strerror}): run no other command at the same time", stacklevel=2
        )
