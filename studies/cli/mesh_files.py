"""Mesh files on the command line: their unit and scale, and questions before they are read."""

import logging
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape
from rich.status import Status

from studies.base.errors import StudyError
from studies.cli.terminal import busy, errors, visible
from studies.geometry.files.estimate import size_warning
from studies.geometry.files.faults import check_promises
from studies.geometry.files.opening import opened
from studies.geometry.files.units import UNITS, Source, check_unit, length_of, likely_units, unit_question
from studies.geometry.mesher.process import STAGES

Unit = Annotated[str | None, typer.Option(help="unit of the file's coordinates: m, cm, mm or in")]
Scale = Annotated[float, typer.Option(help="factor on the file's coordinates")]
LongestSide = Annotated[str | None, typer.Option(help="longest side of the body, such as 19cm, instead of --unit")]
Part = Annotated[str | None, typer.Option(help="a body of the file: its name, number or mask label")]
Yes = Annotated[bool, typer.Option("--yes", "--force", help="read a very large file without asking")]


def source_of(path: Path, unit: str | None, scale: float, longest_side: str | None, part: str | None) -> Source:
    """The options of a file together. Raises StudyError for those that do not go together."""
    return Source(path, unit, scale, None if longest_side is None else length_of(longest_side), part)


def settled(source: Source, yes: bool) -> Source:
    """The file with its unit, once it may be read: asks at the terminal, or raises StudyError."""
    ask_before_large(source.path, yes)
    return with_unit(source)


def ask_before_large(path: Path, yes: bool) -> None:
    """Warn of a large file before reading it: go on when --yes or an answer allows it, else raise StudyError."""
    if path.is_file():
        check_promises(path)
    sentence = size_warning(path) if path.is_file() else None
    if sentence is None:
        return
    if yes:
        errors.print(f"warning: {sentence}", markup=False, highlight=False)
    elif not (sys.stdin.isatty() and typer.confirm(visible(f"{sentence}. Go on?"))):
        raise StudyError(f"{sentence}; say --yes to go on, or reduce it in the program that made it")


def with_unit(source: Source) -> Source:
    """With the unit that the user types, where one is needed and there is a terminal."""
    path = source.path
    if source.unit or source.longest_side or not sys.stdin.isatty() or not path.is_file():
        return source
    content = opened(source)
    side = source.scale * content.longest_side
    if content.unit is not None or likely_units(side) == ["m"]:
        return source
    likely = (likely_units(side) or ["mm"])[-1]
    question = f"{unit_question(path.name, side)}. Which unit is it ({', '.join(UNITS)})?"
    answer = typer.prompt(visible(question), default=likely)
    check_unit(answer)
    return replace(source, unit=str(answer))


EVERY = 40.0
"""Least time [s] between two lines about the stage of the mesher, where there is no terminal."""


class Telling(logging.Handler):
    """Shows the stage of the mesher: next to the moving line of a terminal, elsewhere as a line now and then."""

    def __init__(self, what: str, status: Status | None):
        """what: the work as a whole; status: the terminal's moving line."""
        super().__init__()
        self.what, self.status, self.last_report = what, status, time.monotonic()

    def emit(self, record: logging.LogRecord) -> None:
        """Called for each stage."""
        if self.status is not None:
            self.status.update(escape(f"{self.what} … {record.getMessage()}"))
        elif time.monotonic() - self.last_report > EVERY:
            self.last_report = time.monotonic()
            errors.print(f"{self.what} … {record.getMessage()}", markup=False, highlight=False)


@contextmanager
def working(what: str) -> Iterator[None]:
    """Shows the stage of a long task: a line that moves, or lines where there is no terminal."""
    with busy(escape(what)) as status:
        handler, level = Telling(what, status), STAGES.level
        STAGES.addHandler(handler)
        STAGES.setLevel(logging.INFO)
        try:
            yield
        finally:
            STAGES.removeHandler(handler)
            STAGES.setLevel(level)
