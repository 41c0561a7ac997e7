"""A study by name: of the catalogue, or of a Python file that somebody wrote."""

import importlib.util
import sys
import traceback
from pathlib import Path

from massspring.errors import MassSpringError
from studies.base.errors import StudyError
from studies.base.lookup import choose
from studies.catalog import STUDIES, Study
from studies.runs.case import case_from_json

MODULE = "organbench_user_study"


def find_study(name: str) -> Study:
    """A study of the catalogue, or STUDY of a Python file. Raises StudyError, for whatever is wrong with the file."""
    if not name.endswith(".py"):
        return choose(name, {study.name: study for study in STUDIES}, "study")
    if not Path(name).is_file():
        raise StudyError(f"there is no study file {name}; give a Python file that defines STUDY")
    study = _load(Path(name).resolve())
    if not isinstance(study, Study):
        raise StudyError(f"{name} defines no STUDY of type studies.catalog.Study; see CONTRIBUTING.md")
    for case in study.cases:
        if case_from_json(case.key) != case.replaced(timed=False):
            raise StudyError(f"{name}: case {case.name} cannot be stored and read back; use the project's own types")
    return study


def _load(path: Path) -> object:
    spec = importlib.util.spec_from_file_location(MODULE, path)
    assert spec is not None  # the name ends in .py
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[MODULE] = module  # its own dataclasses look themselves up there
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # the file of a user may fail in any way
        raise StudyError(f"{path.name} cannot be loaded: {_what_failed(path, error)}; mend it and run again") from error
    return getattr(module, "STUDY", None)


def _what_failed(path: Path, error: Exception) -> str:
    """Kind, first line and place of an error in a user's file."""
    if isinstance(error, SyntaxError):
        return f"SyntaxError in line {error.lineno}: {error.msg}"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    kind = "" if isinstance(error, StudyError | MassSpringError) else f"{type(error).__name__} "
    return f"{kind}in line {lines[-1] if lines else '?'}: " + str(error).split("\n")[0]
