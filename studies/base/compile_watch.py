"""Which functions numba compiles, as it begins and ends; what it finds in its cache is not told."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from numba.core import event


@dataclass
class CompileWatch(event.Listener):
    """Listens to numba's events. Functions compiled on the way to another count as part of it.

    begun: called with the name of a function that numba begins to compile
    seconds: spent compiling so far [s]; names: of what was compiled
    """

    begun: Callable[[str], object]
    seconds: float = 0.0
    names: list[str] = field(default_factory=list)
    depth: int = 0
    since: float = 0.0

    def on_start(self, event: event.Event) -> None:
        """One begins."""
        self.depth += 1
        if self.depth == 1:
            self.since = time.perf_counter()
            name = getattr((event.data or {}).get("dispatcher"), "__name__", "a function")
            self.names.append(name)
            self.begun(name)

    def on_end(self, event: event.Event) -> None:
        """One has ended."""
        self.depth -= 1
        if self.depth == 0:
            self.seconds += time.perf_counter() - self.since


@contextmanager
def watching(begun: Callable[[str], object]) -> Iterator[CompileWatch]:
    """Inside, `begun` is called with the name of every function that numba compiles, in this process."""
    watch = CompileWatch(begun)
    with event.install_listener("numba:compile", watch):
        yield watch
