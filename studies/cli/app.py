"""The command line: reads words, calls the library, prints. Bad input ends in one sentence and exit code 2."""

import errno
import io
import os
import sys
import tempfile
import traceback
import warnings
from typing import Annotated

import typer

import studies
from massspring.errors import MassSpringError
from reference_fem.errors import SolveError
from studies.base import interrupts
from studies.base.errors import StudyError
from studies.cli.groups import Commands, add_commands
from studies.cli.terminal import errors, say
from studies.runs.user_code import AGAIN, fault_of

app = typer.Typer(cls=Commands, no_args_is_help=True, pretty_exceptions_enable=False)
add_commands(app)
TRACEBACK = "ORGANBENCH_TRACEBACK"
"""An environment variable for developers: set, an unforeseen error ends in its traceback."""


def show_version(flag: bool) -> None:
    if flag:
        say(f"organbench {studies.__version__}")
        raise typer.Exit


@app.callback()
def organbench(
    version: Annotated[
        bool, typer.Option("--version", callback=show_version, is_eager=True, help="Show the version and end.")
    ] = False,
) -> None:
    """How accurate, how fast and how stable are volume-preserving mass-spring organs, against finite elements.

    A FILE.py is a program, whichever command gets it: run only files you trust (SECURITY.md)."""


def main() -> None:
    """Entry point: exit code 0 done, 2 bad input or output that cannot be written, 130 interrupted, 143 ended."""
    warnings.showwarning = lambda message, *_: complain(f"warning: {message}")  # type: ignore[assignment]
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal that has no "±" shows "?"
    code: str | int | None = 0
    try:
        app()
    except SystemExit as stop:  # typer ends with it always, and turns KeyboardInterrupt into interrupts.CODE
        code = stop.code
    except KeyboardInterrupt:  # between two lines of typer
        code = interrupts.exit_code()
    except Exception as error:
        if not interrupts.pressed():
            complain(f"organbench: {message(error)}")
            code = 2
    if interrupts.pressed():  # whatever came of the command: a library may have made something else of it
        code = interrupts.exit_code()
    if code in (interrupts.CODE, interrupts.exit_code()):
        interrupts.close_ears()
        what = "interrupted" if code == interrupts.CODE else "ended by SIGTERM"
        complain(f"organbench: {what}; finished work is stored; run the same command to continue")
    sys.exit(flushed(code))


def message(error: Exception) -> str:
    """The sentence for an error. The traceback of one that nobody foresaw goes to a file; it is raised again where
    TRACEBACK is set."""
    if isinstance(error, (StudyError, MassSpringError, SolveError)):
        return str(error)
    fault = fault_of(error)
    if fault is not None:
        return fault + AGAIN
    # An error with a file name is not one of the terminal's.
    if isinstance(error, OSError) and error.filename is None and error.errno in (errno.ENOSPC, errno.EIO, errno.EBADF):
        return unwritten(error)
    if os.environ.get(TRACEBACK):
        raise error
    first = str(error).strip().split("\n")[0]
    what = f"failed unexpectedly: {type(error).__name__}" + (f": {first}" if first else "")
    text = "".join(traceback.format_exception(error))
    try:
        handle, path = tempfile.mkstemp(prefix="organbench-traceback-", suffix=".txt")
        with open(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(text)
    except OSError:
        complain(text)
        return f"{what}; please report it with the lines above"
    return f"{what}; the traceback is in {path}; please report it"


def unwritten(error: OSError) -> str:
    return f"the output could not be written ({error.strerror}); stored results are kept"


def complain(sentence: str) -> None:
    """To standard error, where that can be written to."""
    try:
        errors.print(sentence, markup=False, highlight=False)
    except OSError:
        return


def flushed(code: str | int | None) -> str | int | None:
    """`code`, or 2 when the last lines of the output cannot be written; later the interpreter would complain."""
    output = sys.stdout
    if output is None or output.closed:
        return code
    try:
        output.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), output.fileno())
        if code or isinstance(error, BrokenPipeError):  # it was printed before, or the reader has closed the pipe
            return code
        complain(f"organbench: {unwritten(error)}")
        return 2
    return code
