"""Shared by all commands: where they print, and the options for results and studies."""

import time
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread
from typing import Annotated, Any

import typer
from rich.console import Console, ConsoleOptions, RenderableType
from rich.markup import escape
from rich.segment import Segment

from studies.base.doing import hearing
from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.scene.library import CUT, SCENES

STEERING = {"Cc", "Cf", "Cs"}
"""Categories of Unicode whose characters steer a terminal, or the direction of a text, and have no shape."""
KEPT = "\n\t"
QUIET_SECONDS = 10.0
"""Without a terminal (a log file), a line so often while something takes long."""


def visible(text: str) -> str:
    r"""The text with every character that would steer the terminal as its number: ESC is \x1b."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(_number(c) if unicodedata.category(c) in STEERING and c not in KEPT else c for c in text)


def _number(character: str) -> str:
    return character.encode("unicode_escape", "surrogatepass").decode("ascii")


class VisibleConsole(Console):
    """A console on which texts of files cannot steer the terminal: names, messages, parts of meshes, whoever wrote
    them. Colours and moving lines are Rich's own."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Every text that is printed comes by here; a segment with control codes is Rich's."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(visible(segment.text), segment.style)


console = VisibleConsole(soft_wrap=True)
errors = VisibleConsole(stderr=True, soft_wrap=True)


def _results_folder(path: Path) -> Path:
    if path.exists() and not path.is_dir():
        raise StudyError(f"{path} is a file; give the folder of the results (--results)")
    return path


Results = Annotated[
    Path,
    typer.Option("--results", envvar="ORGANBENCH_RESULTS", callback=_results_folder, help="folder of the results"),
]
PROGRAM = "FILE.py is a program: run only files you trust"


def studies(incomplete: str) -> list[str]:
    return [study.name for study in STUDIES if study.name.startswith(incomplete)]


def scenes(incomplete: str) -> list[str]:
    return [scene.name for scene in (*SCENES, *CUT) if scene.name.startswith(incomplete)]


StudyName = Annotated[
    str,
    typer.Argument(
        autocompletion=studies,
        help=f"a study (see `organbench list studies`), or a FILE.py that defines STUDY or SCENE ({PROGRAM})",
    ),
]
SceneName = Annotated[
    str,
    typer.Argument(
        autocompletion=scenes,
        help="a scene (see `organbench list scenes`), or a FILE.py that defines SCENE or STUDY; FILE.py:NAME where it "
        f"has several ({PROGRAM})",
    ),
]
SMOKE = "smoke"
"""Folder below the results for small meshes and few frames."""
Smoke = Annotated[bool, typer.Option("--smoke", help="small meshes and few frames; stored in results/smoke")]


def say(text: object) -> None:
    """A line on standard output, as it is."""
    console.print(str(text), markup=False, highlight=False)


def warn(sentences: list[str]) -> None:
    """Warnings on standard error, a line each."""
    for sentence in sentences:
        errors.print(f"warning: {sentence}", markup=False, highlight=False)


@contextmanager
def busy(what: str) -> Iterator[Any]:
    """A line that moves while something takes long; where there is no terminal, a line every QUIET_SECONDS. It says
    what is being done."""
    begun, now = time.monotonic(), what
    beat = beating(lambda: errors.print(f"{now}, {time.monotonic() - begun:.0f} s", markup=False, highlight=False))
    with errors.status(f"{escape(what)} …") if errors.is_terminal else beat as status:

        def hear(more: str) -> None:
            nonlocal now
            now = f"{what}: {more}"
            if status is not None:
                status.update(f"{escape(now)} …")

        with hearing(hear):
            yield status


@contextmanager
def beating(beat: Callable[[], None]) -> Iterator[None]:
    """Inside, calls `beat` every QUIET_SECONDS, from a thread."""
    ended = Event()

    def run() -> None:
        while not ended.wait(QUIET_SECONDS):
            beat()

    thread = Thread(target=run, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
