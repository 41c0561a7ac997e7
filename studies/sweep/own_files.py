"""Python files of a user, loaded with all that they add: methods and laws, for this process and for workers."""

from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

from studies.base import interrupts
from studies.base.errors import StudyError
from studies.base.own_file import OwnFile, load_own, read_own
from studies.base.study_file import what_failed
from studies.runs.case import Case
from studies.runs.own import add_methods, files_of

Given = tuple[str, bytes]
"""Path and content of a file: what a worker gets, so that it runs what this process has read."""


def load_file(path: Path) -> ModuleType:
    """The module of a user's file. Raises StudyError, for whatever is wrong with it."""
    try:
        return _loaded(read_own(path))
    except OSError as error:
        raise StudyError(f"{path} cannot be read ({error.strerror}); give a Python file") from error


def given_files(cases: Iterable[Case]) -> tuple[Given, ...]:
    """The files that cases need, for workers."""
    files = {file for case in cases for file in files_of(case.method, case.body.law)}
    return tuple(sorted((str(file.path), file.content) for file in files))


def load_given(files: tuple[Given, ...]) -> None:
    """In a worker: the files of the process that started it, under the same names. Raises StudyError."""
    for path, content in files:
        _loaded(read_own(Path(path), content))


def _loaded(file: OwnFile) -> ModuleType:
    try:
        module = load_own(file)
    except BaseException as error:  # the file of a user may fail in any way, and may leave by sys.exit
        if isinstance(error, KeyboardInterrupt) and (interrupts.pressed() or not interrupts.are_heard()):
            raise
        fault = what_failed(file.path, error)
        raise StudyError(f"{file.path.name} cannot be loaded: {fault}; mend it and run again") from error
    add_methods(module)
    return module
