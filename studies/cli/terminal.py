"""What all commands share: where they print, and the words for results and studies."""

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

console = Console(soft_wrap=True)
errors = Console(stderr=True, soft_wrap=True)

Results = Annotated[Path, typer.Option("--results", envvar="ORGANBENCH_RESULTS", help="folder of the results")]
StudyName = Annotated[str, typer.Argument(help="a study (see `organbench list`), or a FILE.py that defines STUDY")]


def say(text: object) -> None:
    """A line on standard output, as it is."""
    console.print(str(text), markup=False, highlight=False)


def warn(sentences: list[str]) -> None:
    """Warnings on standard error, a line each."""
    for sentence in sentences:
        errors.print(f"warning: {sentence}", markup=False, highlight=False)


def busy(what: str) -> Any:
    """A line that moves while something takes long; nothing where there is no terminal."""
    return errors.status(f"{what} …") if errors.is_terminal else nullcontext()
