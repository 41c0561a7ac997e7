"""A lock that lets only one command at a time measure on a results folder: two would slow each other down."""

import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

try:
    import fcntl
except ImportError:  # not POSIX: there a second command does not wait
    fcntl = None


@contextmanager
def alone(root: Path, waits: Callable[[], object] = lambda: None) -> Iterator[None]:
    """Inside, no other command holds the lock of the same folder. `waits` is called first if another one does.

    The operating system frees the lock when its process ends. Warns if the file system has no locks.
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
