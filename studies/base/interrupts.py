"""Ctrl-C and SIGTERM. The terminal sends them to every process of a command at once, in no order; one of them answers
for all.

Python turns Ctrl-C into KeyboardInterrupt wherever the main thread happens to be; SIGTERM is made the same here. Three
moments need care: a worker may die of it before the main process hears of it, a process that is just starting would
print a traceback, and an exception raised inside a destructor or a callback of compiled code is lost. kill -9 leaves
no moment at all: processes that were started end when the one that started them is gone.
"""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

SIGNALS = (signal.SIGINT, signal.SIGTERM)
CODE = 130
"""Exit code of a command that was interrupted, as shells have it: 128 and the number of the signal."""


class _Heard:
    number = 0


def _press(number: int, frame: FrameType | None) -> None:
    _Heard.number = _Heard.number or number
    raise KeyboardInterrupt


@contextmanager
def listening() -> Iterator[None]:
    """Inside, a signal is remembered besides raising KeyboardInterrupt. Does nothing for a signal that
    has another handler: a job in the background ignores Ctrl-C."""
    before = {number: signal.getsignal(number) for number in SIGNALS}
    usual = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}
    ours = [number for number in SIGNALS if before[number] is usual[number]]
    _Heard.number = 0
    for number in ours:
        signal.signal(number, _press)
    try:
        yield
    finally:
        for number in ours if not _Heard.number else ():
            signal.signal(number, before[number])


def close_ears() -> None:
    """A process that was interrupted and is about to say so ignores further signals."""
    for number in SIGNALS:
        if signal.getsignal(number) is _press:
            signal.signal(number, signal.SIG_IGN)


def are_heard() -> bool:
    """Whether Ctrl-C would be remembered now: then a KeyboardInterrupt without one was raised by other code."""
    return signal.getsignal(signal.SIGINT) is _press


def pressed() -> bool:
    """Whether Ctrl-C or SIGTERM came since `listening` began."""
    return _Heard.number != 0


def exit_code() -> int:
    """128 and the number of the signal that came; CODE when none was remembered."""
    return 128 + _Heard.number if _Heard.number else CODE


def stop_if_pressed() -> None:
    """Raises KeyboardInterrupt again, for the case that the first one was lost."""
    if pressed():
        raise KeyboardInterrupt


@contextmanager
def held_back() -> Iterator[None]:
    """Inside, signals wait, for this process and for those it starts; at the end they come to this one. For the main
    thread, as everything that sets handlers."""
    handlers = {number: signal.getsignal(number) for number in SIGNALS if callable(signal.getsignal(number))}
    if not handlers or not hasattr(signal, "pthread_sigmask"):
        yield
        return
    waiting: list[int] = []
    for number in handlers:
        signal.signal(number, lambda number, frame: waiting.append(number))
    # Only a mask is handed on to new processes; here another thread may still take the signal.
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, handlers)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if waiting:
            signal.raise_signal(waiting[0])


def die_quietly() -> None:
    """A worker ends at once at a signal, without a traceback, and one that waited since `held_back` does so now; it
    also ends when its parent is gone, however that ended."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    parent = multiprocessing.parent_process()
    if parent is not None:
        end_after(parent.join)


def end_after(wait: Callable[[], object]) -> None:
    """This process ends, without a word, as soon as `wait` returns: when a pipe is closed that only its parent holds
    open. The system closes it whatever ended the parent, also before this was called."""

    def watch() -> NoReturn:
        wait()
        os._exit(1)

    threading.Thread(target=watch, daemon=True, name="ends with its parent").start()


def died_of_it(exit_code: int | None) -> bool:
    """Whether a process with this exit code was ended by Ctrl-C."""
    return os.name == "posix" and exit_code == -signal.SIGINT
