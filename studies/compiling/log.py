"""What numba compiles in this process, function by function. Code that is loaded from disk is not listed."""

import csv
import io
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from time import thread_time
from typing import Any, NamedTuple

from numba.core import event

COMPILE = "numba:compile"
"""numba's event for a function and the types of its arguments."""


class Compiled(NamedTuple):
    """One function for one set of argument types."""

    function: str
    """Module and name."""
    arguments: str
    seconds: float
    """Processor time, without that of the functions that were compiled on the way [s]."""


class CompileLog(event.Listener):
    """Collects what is compiled while it is installed."""

    def __init__(self) -> None:
        self.found: list[Compiled] = []
        self._open: list[list[float]] = []

    def on_start(self, event: Any) -> None:
        """A compilation begins, perhaps on the way of another."""
        self._open.append([thread_time(), 0.0])

    def on_end(self, event: Any) -> None:
        """The one that began last ends."""
        begun, others = self._open.pop()
        whole = thread_time() - begun
        if self._open:
            self._open[-1][1] += whole
        function = event.data["dispatcher"].py_func
        name = f"{function.__module__}.{function.__qualname__}"
        self.found.append(Compiled(name, str(event.data["args"]), whole - others))


@contextmanager
def logged() -> Iterator[list[Compiled]]:
    """Inside, the list grows by what is compiled."""
    log = CompileLog()
    with event.install_listener(COMPILE, log):
        yield log.found


def log_from_now_on() -> list[Compiled]:
    """A list that grows by what this process compiles."""
    log = CompileLog()
    event.register(COMPILE, log)
    return log.found


def summary(found: Iterable[Compiled], most: int = 10) -> list[str]:
    """Lines: how much was compiled, how much of it twice, and the `most` functions that took longest."""
    entries = list(found)
    distinct = {(entry.function, entry.arguments) for entry in entries}
    total = sum(entry.seconds for entry in entries)
    lines = [
        f"{len(entries)} compiled in {total:.1f} s of processor time, {len(entries) - len(distinct)} of them again"
    ]
    functions: dict[str, list[float]] = {}
    for entry in entries:
        functions.setdefault(entry.function, []).append(entry.seconds)
    by_time = sorted(functions.items(), key=lambda item: -sum(item[1]))
    return lines + [f"{sum(times):8.2f} s  {len(times):3d} x  {name}" for name, times in by_time[:most]]


def listing(found: Iterable[Compiled]) -> str:
    """A CSV table with a row for each function and its argument types."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(("function", "processor time [s]", "arguments"))
    table.writerows((entry.function, f"{entry.seconds:.3f}", entry.arguments) for entry in found)
    return text.getvalue()
