"""The Python file of a user that defines a study: what is wrong with it, in a sentence."""

from pathlib import Path

from massspring.errors import MassSpringError
from studies.base.errors import StudyError
from studies.base.own_file import line_of, loaded_from


def fault_of_study_file(error: BaseException) -> str | None:
    """The sentence for an error that passed through a file of the user; None for another."""
    file = loaded_from(error)
    return None if file is None else f"{file.path.name} fails: {what_failed(file.path, error)}; mend it and run again"


def what_failed(path: Path, error: BaseException) -> str:
    """Kind, first line and place of an error in a user's file."""
    if isinstance(error, SyntaxError) and error.filename == str(path):
        return f"SyntaxError in line {error.lineno}: {error.msg}"
    line = line_of(path, error)
    kind = "" if isinstance(error, StudyError | MassSpringError) else f"{type(error).__name__} "
    message = str(error).split("\n")[0]
    return f"{kind}in line {line or '?'}" + (f": {message}" if message else "")
