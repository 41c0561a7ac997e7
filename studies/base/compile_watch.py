"""Which functions numba compiles, as it begins and ends; what it finds in its cache is not listed."""

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import NamedTuple

from numba.core import event

EVENT = "numba:compile"
"""numba's event for a function and the types of its arguments."""


class Compiled(NamedTuple):
    """One function for one set of argument types."""

    function: str
    """Module and name."""
    arguments: str
    seconds: float
    """Processor time, without that of the functions that were compiled on the way [s]."""


@dataclass
class CompileWatch(event.Listener):
    """Listens to numba's events.

    begun: called with the name of a function that numba begins to compile, not of those compiled on the way
    seconds: wall time spent compiling so far [s]; compiled: every function, in the order in which they end
    """

    begun: Callable[[str], object] = lambda name: None
    seconds: float = 0.0
    compiled: list[Compiled] = field(default_factory=list)
    _since: float = 0.0
    _open: list[list[float]] = field(default_factory=list)
    """Of each function that is being compiled: processor time at its begin, and that of those on its way [s]."""

    def on_start(self, event: event.Event) -> None:
        """A compilation begins, perhaps on the way of another."""
        if not self._open:
            self._since = time.perf_counter()
            self.begun(getattr((event.data or {}).get("dispatcher"), "__name__", "a function"))
        self._open.append([time.thread_time(), 0.0])

    def on_end(self, event: event.Event) -> None:
        """The one that began last ends."""
        begun, others = self._open.pop()
        whole = time.thread_time() - begun
        if self._open:
            self._open[-1][1] += whole
        else:
            self.seconds += time.perf_counter() - self._since
        data = event.data or {}
        function = getattr(data.get("dispatcher"), "py_func", None)
        name = "a function" if function is None else f"{function.__module__}.{function.__qualname__}"
        self.compiled.append(Compiled(name, str(data.get("args")), whole - others))


@contextmanager
def watching(begun: Callable[[str], object] = lambda name: None) -> Iterator[CompileWatch]:
    """Inside, `begun` is called with the name of every function that numba compiles, in this process."""
    watch = CompileWatch(begun)
    with event.install_listener(EVENT, watch):
        yield watch


def summary(compiled: Iterable[Compiled], most: int = 10) -> list[str]:
    """Lines: how much was compiled, how much of it twice, and the `most` functions that took longest."""
    entries = list(compiled)
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
