"""Ctrl-C. The terminal sends it to every process of a command at once, in no order; one of them answers for all.

Python turns it into KeyboardInterrupt wherever the main thread happens to be. Three moments need care: a worker may die
of it before the main process hears of it, a process that is just starting would print a traceback, and an exception
raised inside a destructor or a callback of compiled code is lost.
"""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

CODE = 130
"""Exit code of a command that was interrupted, as shells have it: 128 and the number of the signal."""


class _Heard:
    pressed = False


def _press(number: int, frame: FrameType | None) -> None:
    _Heard.pressed = True
    raise KeyboardInterrupt


@contextmanager
def listening() -> Iterator[None]:
    """Inside, a Ctrl-C is remembered besides raising KeyboardInterrupt. Does nothing where SIGINT has another handler:
    a job in the background ignores it."""
    before = signal.getsignal(signal.SIGINT)
    _Heard.pressed = False
    if before is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, _press)
    try:
        yield
    finally:
        if not _Heard.pressed:
            signal.signal(signal.SIGINT, before)


def close_ears() -> None:
    """A process that was interrupted and is about to say so ignores further ones."""
    if signal.getsignal(signal.SIGINT) is _press:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def pressed() -> bool:
    """Whether Ctrl-C came since `listening` began."""
    return _Heard.pressed


def stop_if_pressed() -> None:
    """Raises KeyboardInterrupt again, for the case that the first one was lost."""
    if _Heard.pressed:
        raise KeyboardInterrupt


@contextmanager
def held_back() -> Iterator[None]:
    """Inside, Ctrl-C waits, for this process and for those it starts; at the end it comes to this one. For the main
    thread, as everything that sets handlers."""
    handler = signal.getsignal(signal.SIGINT)
    if not callable(handler) or not hasattr(signal, "pthread_sigmask"):
        yield
        return
    waiting: list[int] = []
    signal.signal(signal.SIGINT, lambda number, frame: waiting.append(number))
    # Only a mask is handed on to new processes; here another thread may still take the signal.
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, handler)
        if waiting:
            signal.raise_signal(signal.SIGINT)


def die_quietly() -> None:
    """A worker ends at once at Ctrl-C, without a traceback, and one that waited since `held_back` does so now."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def died_of_it(exit_code: int | None) -> bool:
    """Whether a process with this exit code was ended by Ctrl-C."""
    return os.name == "posix" and exit_code == -signal.SIGINT
