"""`organbench replay`: does a stored run come out the same?"""

from pathlib import Path
from typing import Annotated

import typer

from studies.base.errors import StudyError
from studies.cli.terminal import say
from studies.exchange.entry import ENTRY
from studies.runs.run import own_files_of
from studies.runs.run import replay as replay_run
from studies.store.record import peek
from studies.sweep.own_files import load_file


def replay(
    path: Path,
    file: Annotated[
        list[Path] | None, typer.Option(help="FILE.py of yours that it was made with, where that has moved")
    ] = None,
) -> None:
    """Runs exactly that case again, and says whether it came out the same (exit code 1: it did not)."""
    load_own_files(path, file or [])
    stored, new, difference = replay_run(path)
    if difference is None:
        say(f"{stored.name}: the same, bit for bit ({new.status})")
        return
    say(f"{stored.name}: {difference}")
    if stored.fingerprint != new.fingerprint:
        say("the code has changed since it was stored")
    if stored.machine != new.machine:
        say("it was stored on another machine")
    raise typer.Exit(1)


def load_own_files(path: Path, moved: list[Path]) -> None:
    """The user's files that the run in `path` was made with; those in `moved` instead of ones of the same name, one
    instead of one whatever it is called.

    Raises StudyError for one that is not there any more.
    """
    record = peek(path)
    if record.attributes.get(ENTRY) is not None:
        raise StudyError(f"{path} is an entry from outside: only the program that made it can run it again")
    wanted = [Path(name) for name in own_files_of(record)]
    instead = {file.name: file for file in moved}
    if len(wanted) == len(moved) == 1:
        instead = {wanted[0].name: moved[0]}
    for name in wanted:
        file = instead.get(name.name, name)
        if not file.is_file():
            raise StudyError(f"{path} was made with {file}, which is not there; --file FILE.py says where it is now")
        load_file(file)
