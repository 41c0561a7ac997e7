"""The Python file of a user that defines a study: whether a thing, or an error, is of it."""

import sys
import traceback
from pathlib import Path

from massspring.errors import MassSpringError
from studies.base.errors import StudyError
from studies.base.old_imports import advice

MODULE = "organbench_user_study"
"""The name under which it is loaded."""


def fault_of_study_file(error: BaseException) -> str | None:
    """The sentence for an error that passed through the study file that was loaded; None for another."""
    module = sys.modules.get(MODULE)
    if module is None or module.__file__ is None:
        return None
    path = Path(module.__file__)
    if str(path) not in [frame.filename for frame in traceback.extract_tb(error.__traceback__)]:
        return None
    return f"{path.name} fails: {what_failed(path, error)}; mend it and run again"


def is_of_study_file(thing: object) -> bool:
    """Whether a function or class was written there."""
    return getattr(thing, "__module__", None) == MODULE


def what_failed(path: Path, error: BaseException) -> str:
    """Kind, first line and place of an error in a user's file."""
    if isinstance(error, SyntaxError) and error.filename == str(path):
        return f"SyntaxError in line {error.lineno}: {error.msg}"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    if isinstance(error, ImportError) and lines and lines[-1]:
        moved = advice(path.read_bytes(), lines[-1])
        if moved:
            return f"in line {lines[-1]}, {moved}"
    kind = "" if isinstance(error, StudyError | MassSpringError) else f"{type(error).__name__} "
    message = str(error).split("\n")[0]
    return f"{kind}in line {lines[-1] if lines else '?'}" + (f": {message}" if message else "")
