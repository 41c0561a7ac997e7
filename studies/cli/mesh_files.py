"""Mesh files on the command line: their unit and scale, and questions before they are read."""

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from studies.base.errors import StudyError
from studies.cli.terminal import visible, warn
from studies.geometry.files.faults import check_promises, size_warning
from studies.geometry.files.opening import opened
from studies.geometry.files.units import UNITS, Source, check_unit, length_of, likely_units, unit_question

Unit = Annotated[str | None, typer.Option(help="unit of the file's coordinates: m, cm, mm, um or in")]
Scale = Annotated[float, typer.Option(help="factor on the file's coordinates")]
LongestSide = Annotated[str | None, typer.Option(help="longest side of the body, such as 19cm, instead of --unit")]
Part = Annotated[str | None, typer.Option(help="a body of the file: its name, number or mask label")]
Yes = Annotated[bool, typer.Option("--yes", "--force", help="read a very large file without asking")]
MM = 1e-3


def source_of(path: Path, unit: str | None, scale: float, longest_side: str | None, part: str | None) -> Source:
    """The options of a file together. Raises StudyError for those that do not go together."""
    return Source(path, unit, scale, None if longest_side is None else length_of(longest_side), part)


def in_metres(millimetres: float | None) -> float | None:
    return None if millimetres is None else millimetres / 1e3  # 6.2 * 1e-3 is 0.006200000000000001


def ask_before_large(path: Path, yes: bool) -> None:
    """Warns of a large file before reading it: goes on when --yes or an answer allows it, else raises StudyError."""
    if not path.is_file():
        return
    check_promises(path)
    sentence = size_warning(path)
    if sentence is None:
        return
    if yes:
        warn([sentence])
    elif not (sys.stdin.isatty() and typer.confirm(visible(f"{sentence}. Go on?"))):
        raise StudyError(f"{sentence}; say --yes to go on, or reduce it in the program that made it")


def settled(source: Source, yes: bool) -> Source:
    """The file with its unit, once it may be read: asks at the terminal where one is needed, or raises StudyError."""
    path = source.path
    ask_before_large(path, yes)
    if source.unit or source.longest_side or not sys.stdin.isatty() or not path.is_file():
        return source
    content = opened(source)
    side = source.scale * content.longest_side
    if content.unit is not None or likely_units(side) == ["m"]:
        return source
    likely = (likely_units(side) or ["mm"])[-1]
    question = f"{unit_question(path.name, side)}. Which unit is it ({', '.join(UNITS)})?"
    answer = str(typer.prompt(visible(question), default=likely))
    check_unit(answer)
    return replace(source, unit=answer)
