"""Progress on the terminal: a bar for what takes longer than a moment, plain lines where there is no terminal."""

import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from studies.base.interrupts import stop_if_pressed

QUIET_SECONDS = 10.0
"""Without a terminal (a log file), a line at most this often."""


class TerminalProgress:
    """Shows the stages of a sweep; a context manager, because a bar must be taken off the screen again."""

    def __init__(self, console: Console) -> None:
        columns = (TextColumn("{task.description:>10}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
        self.console = console
        self.bars = Progress(*columns, TextColumn("{task.fields[note]}"), console=console, transient=True)
        self.tasks: dict[str, TaskID] = {}
        self.totals: dict[str, list[int]] = {}
        self.told = time.monotonic()

    def __enter__(self) -> "TerminalProgress":
        if self.console.is_terminal:
            self.bars.start()
        return self

    def __exit__(self, kind: type | None, value: BaseException | None, trace: TracebackType | None) -> None:
        if self.console.is_terminal:  # elsewhere stopping would print an empty line
            self.bars.stop()

    def begin(self, what: str, total: int) -> None:
        """A stage of `total` pieces begins."""
        self.totals[what] = [0, total]
        if what in self.tasks:
            self.bars.reset(self.tasks[what], total=total, note="")
        else:
            self.tasks[what] = self.bars.add_task(what, total=total, note="")

    def advance(self, what: str, note: str) -> None:
        """One piece is done; a Ctrl-C that was lost on the way counts here."""
        stop_if_pressed()
        self.bars.update(self.tasks[what], advance=1, note=note)
        self.totals[what][0] += 1
        done, total = self.totals[what]
        due = time.monotonic() - self.told > QUIET_SECONDS or done == total
        if not self.console.is_terminal and due:
            self.told = time.monotonic()
            self.console.print(f"{what} {done}/{total}: {note}", markup=False, highlight=False)
