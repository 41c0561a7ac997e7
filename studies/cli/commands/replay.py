"""`organbench replay`: does a stored run come out the same?"""

import hashlib
import shlex
from pathlib import Path
from typing import Annotated

import typer

from studies.base.errors import DamagedFile, StudyError
from studies.cli.terminal import say, warn
from studies.exchange.entry import ENTRY
from studies.runs.run import own_files_of
from studies.runs.run import replay as replay_run
from studies.runs.user_code import load_file
from studies.store.record import peek


def replay(
    path: Annotated[Path, typer.Argument(help="a results file")],
    file: Annotated[
        list[Path] | None,
        typer.Option(help="the FILE.py that made it. It runs as a program: name only a file you trust"),
    ] = None,
    changed: Annotated[bool, typer.Option("--changed", help="run a FILE.py also if it has changed since")] = False,
) -> None:
    """Run one stored case again and compare the results. Exit code 1: they differ.

    A case with a method or law of your own needs --file, and --changed where the file has changed.
    """
    load_own_files(path, file or [], changed)
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


def load_own_files(path: Path, given: list[Path], changed: bool) -> None:
    """Loads the user's files that the run in `path` was made with: those of `given` with the same names, or the only
    one of `given` whatever its name. The paths in the record are not opened: a stranger may have written them,
    and the SHA-256 with them.

    Raises StudyError, before any of them is loaded, where one is not among `given`, or its SHA-256 is not the one in
    the record; of files that may have `changed` warns instead.
    """
    record = peek(path)
    if record.attributes.get(ENTRY) is not None:
        raise StudyError(f"{path} is a result of another program: only that program can run it again")
    try:
        digests = own_files_of(record)
    except ValueError:
        digests = None
    if not isinstance(digests, dict) or not all(isinstance(digest, str) for digest in digests.values()):
        raise DamagedFile(f"{path} does not say which files it was made with: delete it, or run its study again")
    by_name = {file.name: file for file in given}
    if len(digests) == len(given) == 1:
        by_name = {Path(name).name: given[0] for name in digests}
    missing = [name for name in digests if Path(name).name not in by_name]
    if missing:
        raise StudyError(
            f"{path} was made with the program {missing[0]}, and programs run only when you name them: add "
            f"--file {shlex.quote(missing[0])}, or where it is now, if you trust it"
        )
    files = {by_name[Path(name).name]: digest for name, digest in digests.items()}
    for file, digest in files.items():
        if file.is_file() and hashlib.sha256(file.read_bytes()).hexdigest() != digest:
            sentence = f"{file} is not the file that {path} was made with: its content has changed"
            if not changed:
                raise StudyError(f"{sentence}; add --changed to run it all the same")
            warn([sentence])
    for file in files:
        load_file(file)
