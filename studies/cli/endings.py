"""How a command ends: the message for an error, and what happens when it cannot be written."""

import errno
import os
import sys

from massspring.errors import MassSpringError
from reference_fem.errors import SolveError
from studies.base.errors import StudyError
from studies.base.study_file import fault_of_study_file
from studies.cli.terminal import errors


def message(error: Exception) -> str:
    """The sentence for an error. Raises an unforeseen error again: a fault of this program keeps its traceback."""
    if isinstance(error, (StudyError, MassSpringError, SolveError)):
        return str(error)
    own = fault_of_study_file(error)
    if own is not None:
        return own
    # An error with a file name is not one of the terminal's.
    if isinstance(error, OSError) and error.filename is None and error.errno in (errno.ENOSPC, errno.EIO, errno.EBADF):
        return unwritten(error)
    raise error


def unwritten(error: OSError) -> str:
    """The sentence for an output that takes no more."""
    return f"the output could not be written ({error.strerror}); what was stored before is kept"


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
