"""Progress on the terminal: a bar for what takes longer than a moment, plain lines where there is no terminal."""

import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from types import TracebackType

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from studies.base.counting import amounts
from studies.base.doing import Doing, hearing
from studies.base.interrupts import stop_if_pressed
from studies.cli.terminal import QUIET_SECONDS, beating, busy
from studies.store.entry import MISSING
from studies.sweep.plan import COPY, Planned, expected, kind_of


def words(seconds: float) -> str:
    """A time as people say it: "8 s", "3 min", "1 h 20 min"."""
    if seconds < 90:
        return f"{max(1, round(seconds))} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"


class TerminalProgress:
    """Shows the stages of a sweep; a context manager, because a bar must be taken off the screen again.

    planned: what is to come, for the time that is left; jobs: processes for the physics
    """

    def __init__(self, console: Console, planned: Iterable[Planned] = (), jobs: int = 1) -> None:
        columns = (TextColumn("{task.description:>7}"), BarColumn(20), MofNCompleteColumn(), TimeElapsedColumn())
        self.console = console
        self.bars = Progress(*columns, TextColumn("{task.fields[note]}"), console=console, transient=True)
        self.tasks: dict[str, TaskID] = {}
        self.totals: dict[str, list[int]] = {}
        self.pending = {(piece.stage, piece.label): piece for piece in planned}
        self.jobs = jobs
        self.done: Counter[str] = Counter()
        """Number of finished pieces, by kind."""
        self.compiled: set[str] = set()
        self.begun = self.last_report = time.monotonic()
        self.last_compile_report = 0.0
        self.beats = ExitStack()
        self.doing = ""

    def __enter__(self) -> "TerminalProgress":
        self.beats.enter_context(hearing(self.hear))
        if self.console.is_terminal:
            self.bars.start()
        else:
            self.beats.enter_context(beating(self._beat))
        return self

    def __exit__(self, kind: type | None, value: BaseException | None, trace: TracebackType | None) -> None:
        self.beats.close()
        if self.console.is_terminal:  # elsewhere stopping would print an empty line
            self.bars.stop()

    def _beat(self) -> None:
        """Where nothing has been said for a while: what is going on."""
        now = time.monotonic()
        if self.totals and now - self.last_report >= QUIET_SECONDS:
            self.last_report = now
            what, (done, total) = list(self.totals.items())[-1]
            left = self.left()
            left, at = f", {left}" if left else "", f": {self.doing}" if self.doing else ""
            self._line(f"{what} {done}/{total} done, {words(now - self.begun)}{left}{at}")

    def begin(self, what: str, total: int) -> None:
        self.totals[what] = [0, total]
        if what in self.tasks:
            self.bars.reset(self.tasks[what], total=total, note=self.left())
        else:
            self.tasks[what] = self.bars.add_task(what, total=total, note=self.left())

    def advance(self, what: str, note: str) -> None:
        """One piece is done; a Ctrl-C that was lost on the way counts here."""
        stop_if_pressed()
        self.pending.pop((what, note), None)
        self.doing = ""  # of several processes the next that begins something says so
        self.done[kind_of(what, note)] += 1
        left = self.left()
        self.bars.update(self.tasks[what], advance=1, note=left or note)
        self.totals[what][0] += 1
        done, total = self.totals[what]
        due = time.monotonic() - self.last_report > QUIET_SECONDS or done == total
        if not self.console.is_terminal and due:
            self.last_report = time.monotonic()
            self._line(f"{what} {done}/{total}: {note}" + (f", {left}" if left else ""))

    def left(self) -> str:
        """The time that is left; nothing where nothing is planned."""
        seconds = expected(list(self.pending.values()), self.jobs)
        return f"about {words(seconds)} left" if seconds else ""

    def hear(self, name: str) -> None:
        """A function is being compiled, or a process says what it does, this one or another; from any thread."""
        if isinstance(name, Doing):
            self.doing = str(name)
            for task in self.tasks.values():
                self.bars.update(task, note=self.doing)
        if isinstance(name, Doing) or name in self.compiled:
            return
        self.compiled.add(name)
        if self.console.is_terminal:
            for task in self.tasks.values():
                self.bars.update(task, note=f"compiling {name} …")
        elif time.monotonic() - self.last_compile_report > QUIET_SECONDS:
            self.last_compile_report = time.monotonic()
            self._line(f"compiling {name} (kept for the next time)")

    def _line(self, text: str) -> None:
        self.console.print(text, markup=False, highlight=False)


@contextmanager
def compiling(doing: str) -> Iterator[Callable[[str], None]]:
    """Inside, what is given names is shown as being compiled, next to what is being done; in a log a line every
    QUIET_SECONDS."""
    with busy(doing) as status:
        yield lambda name: status and status.update(f"{escape(doing)}: compiling {name} (kept for the next time) …")


def dry_run(console: Console, study: str, planned: list[Planned], jobs: int) -> None:
    """Says what would run: how much of what, why, and how long."""

    def say(text: str) -> None:
        console.print(text, markup=False, highlight=False)

    if not planned:
        say(f"{study}: nothing would run: all results are current")
        return
    say(f"{study}: {amounts(Counter(piece.kind for piece in planned))} would run")
    groups: dict[tuple[str, str], list[Planned]] = {}
    for piece in planned:
        groups.setdefault((piece.kind, "missing" if piece.why == MISSING else piece.why), []).append(piece)
    for (kind, why), pieces in groups.items():
        say(f"  {amounts(Counter({kind: len(pieces)}))} ({why}): about {words(expected(pieces, 1))} of computing")
    say(f"  about {words(expected(planned, jobs))} with {jobs} processes, {basis(planned)}; compiling comes on top")


def basis(planned: list[Planned]) -> str:
    """Where an estimate comes from: "from earlier runs of 3 cases, from the rate of another machine for 2 timings"."""
    solved = [piece for piece in planned if piece.kind != COPY]
    sources = {
        "from earlier runs of": [piece for piece in solved if piece.seconds is not None],
        "from the rate of this machine for": [p for p in solved if p.seconds is None and p.here],
        "from the rate of another machine for": [p for p in solved if p.seconds is None and not p.here],
    }
    kinds = {source: Counter(piece.kind for piece in pieces) for source, pieces in sources.items() if pieces}
    return ", ".join(f"{source} {amounts(count)}" for source, count in kinds.items()) or "only copies"
