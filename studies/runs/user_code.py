"""Loads Python files of a user, only those that the user names, and registers their methods and stiffness laws.

A file is identified by the SHA-256 of its bytes, of the modules next to it that it imports, and of the code of this
project that these import. The name of its module contains this hash, since numba stores compiled functions under the
name of their module. So a compiled loop always belongs to the current code.
"""

import hashlib
import sys
import traceback
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, TypeGuard

import numpy as np

from massspring import LITERATURE, METHODS, Body, Method
from massspring.body.laws import Edges, StiffnessLaw, laws_by_name
from massspring.body.membranes import MEMBRANE_LAWS
from massspring.body.smoothed import SMOOTHED
from massspring.errors import MassSpringError
from massspring.sources import own_file, read_source, source_fingerprint
from studies.base import interrupts
from studies.base.errors import StudyError

PREFIX = "organbench_own_"
"""Prefix of the names of their modules."""
AGAIN = "; correct it and run again"
"""End of the message about a faulty file."""
Given = tuple[str, bytes]
"""(path, content) of a file. A worker receives both, so that it runs what this process has read."""


@dataclass(frozen=True)
class UserCode:
    """A file of a user, with its content when it was read."""

    path: Path
    content: bytes
    fingerprint: str
    """SHA-256 (hex) of its bytes, of the modules next to it and of the project's modules that it imports."""

    @property
    def sha256(self) -> str:
        """SHA-256 of its bytes (hex)."""
        return hashlib.sha256(self.content).hexdigest()

    @property
    def module(self) -> str:
        """The name under which it is loaded."""
        return PREFIX + hashlib.sha256(f"{self.path}\0{self.fingerprint}".encode()).hexdigest()[:16]


_LOADED: dict[str, UserCode] = {}
_METHODS: dict[str, type[Method]] = {}
_LAWS: dict[str, StiffnessLaw] = {}


def read_code(path: Path, content: bytes | None = None) -> UserCode:
    """Reads the file at `path` without running it; `content` replaces its present content. Raises OSError."""
    path = path.resolve()
    content = path.read_bytes() if content is None else content
    digest = hashlib.sha256()
    for part in _parts(path, content):
        digest.update(hashlib.sha256(part).digest())
    return UserCode(path, content, digest.hexdigest())


def _parts(path: Path, content: bytes) -> Iterator[bytes]:
    """Names and bytes of the file and of the modules next to it; then the hash of the project's modules that any of
    them imports, and of all methods, since `from massspring import ...` may load any of them."""
    waiting, seen, ours = [(path, content)], {path}, {"massspring.methods"}
    while waiting:
        file, text = waiting.pop()
        yield str(file.relative_to(path.parent)).encode()
        yield text
        try:
            imports = read_source(text, file.stem, file).imports
        except MassSpringError:  # not valid Python: loading it reports that
            continue
        for module, name in imports:
            ours.update(part for part in (module, f"{module}.{name}") if own_file(part) is not None)
            beside = [other for other in _beside(path.parent, module.split(".")[0]) if other not in seen]
            seen.update(beside)
            waiting += [(other, other.read_bytes()) for other in beside]
    yield source_fingerprint(*sorted(ours)).encode()


def _beside(folder: Path, name: str) -> list[Path]:
    """The files of a module, or of a package, in a folder."""
    if not name or own_file(name) is not None:
        return []
    alone = folder / f"{name}.py"
    return [alone] if alone.is_file() else sorted((folder / name).rglob("*.py"))


def load_file(path: Path) -> ModuleType:
    """Runs a user's file and returns its module. Raises StudyError for any fault in the file."""
    try:
        return _loaded(read_code(path))
    except OSError as error:
        raise StudyError(f"{path} cannot be read ({error.strerror}); give a Python file") from error


def given_files(cases: Iterable[Any]) -> tuple[Given, ...]:
    """The user's files that cases (studies.runs.case) need, for workers."""
    files = {file for case in cases for file in files_of(case)}
    return tuple(sorted((str(file.path), file.content) for file in files))


def load_given(files: tuple[Given, ...]) -> None:
    """Run in a worker: loads the files of the process that started it, under the same names. Raises StudyError."""
    for path, content in files:
        _loaded(read_code(Path(path), content))


def _loaded(file: UserCode) -> ModuleType:
    module = ModuleType(file.module)
    module.__file__ = str(file.path)
    sys.modules[file.module] = module  # dataclasses in the file look up their module there
    _LOADED[file.module] = file
    try:
        # A loader of importlib would read the file again, or use a compiled file from the same second.
        exec(compile(file.content, str(file.path), "exec"), vars(module))
    except BaseException as error:  # a user's file may raise any exception, including SystemExit
        if isinstance(error, KeyboardInterrupt) and (interrupts.pressed() or not interrupts.are_heard()):
            raise
        raise StudyError(f"{file.path.name} cannot be loaded: {_fault(file.path, error)}{AGAIN}") from error
    _add_methods(module)
    return module


def file_of(thing: object) -> UserCode | None:
    """The file of a user in which a function or class was written; None for those of this project or a notebook."""
    name = str(getattr(thing, "__module__", ""))
    if name in _LOADED:
        return _LOADED[name]
    return None if own_file(name) is not None else _file_of_module(name)


@cache
def _file_of_module(name: str) -> UserCode | None:
    """The file of a module that the user's program has imported itself."""
    file = getattr(sys.modules.get(name), "__file__", None)
    return read_code(Path(file)) if file is not None and Path(file).is_file() else None


def files_of(case: Any) -> tuple[UserCode, ...]:
    """The user's files that define the method and the law of a case (studies.runs.case), each once."""
    things = [type(case.method), *([_LAWS[case.body.law].stiffness] if case.body.law in _LAWS else [])]
    return tuple({file.path: file for file in map(file_of, things) if file is not None}.values())


def fault_of(error: BaseException) -> str | None:
    """ "mine.py fails: ZeroDivisionError in line 4: division by zero", for an error raised in or through a loaded file;
    None for any other."""
    passed = {frame.filename for frame in traceback.extract_tb(error.__traceback__)}
    path = next((file.path for file in _LOADED.values() if str(file.path) in passed), None)
    return None if path is None else f"{path.name} fails: {_fault(path, error)}"


def _fault(path: Path, error: BaseException) -> str:
    """Kind, place and first line of an error in a user's file."""
    if isinstance(error, SyntaxError) and error.filename == str(path):
        return f"SyntaxError in line {error.lineno}: {error.msg}"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    kind = "" if isinstance(error, StudyError | MassSpringError) else f"{type(error).__name__} "
    message = str(error).split("\n")[0]
    return f"{kind}in line {lines[-1] if lines else '?'}" + (f": {message}" if message else "")


def methods_by_name() -> dict[str, type[Method]]:
    """METHODS, LITERATURE and those of the user's files."""
    return {method.name: method for method in (*METHODS, *LITERATURE)} | _METHODS


def own_laws() -> Mapping[str, StiffnessLaw]:
    """The laws of the user's files, by name."""
    return _LAWS


def law_names() -> tuple[str, ...]:
    """Names of all laws of tetrahedral bodies: those of the project and of the user's files."""
    return (*laws_by_name(), *SMOOTHED, *_LAWS)


def own_law(law: StiffnessLaw) -> str:
    """Registers a law for recipes and returns its name: `TetrahedralBody(law=own_law(StiffnessLaw(bars)))`.

    Raises StudyError for an object that is no law, for a name that another law has, and for a law that is not defined
    in a file.
    """
    if not isinstance(law, StiffnessLaw):
        raise StudyError(f"a law is {law!r}; give a StiffnessLaw, as StiffnessLaw(function)")
    file = file_of(law.stiffness)
    if file is None:
        raise StudyError(f"law '{law.name}' is not written in a file; write its function in a FILE.py")
    before = _LAWS.get(law.name)
    project = (*laws_by_name(), *SMOOTHED, *MEMBRANE_LAWS)
    _check_free("law", law.name, project, file, before and file_of(before.stiffness))
    _LAWS[law.name] = law
    return law.name


def _add_methods(module: ModuleType) -> None:
    """Registers the methods that a user's module defines or imports. Raises StudyError for a name that is taken."""
    project = [method.name for method in (*METHODS, *LITERATURE)]
    for value in filter(_is_method, list(vars(module).values())):
        file = file_of(value)
        if file is not None:
            before = _METHODS.get(value.name)
            _check_free("method", value.name, project, file, before and file_of(before))
            _METHODS[value.name] = value


def _is_method(value: object) -> TypeGuard[type[Method]]:
    return isinstance(value, type) and Method in value.__mro__ and value is not Method


def _check_free(noun: str, name: str, project: Iterable[str], file: UserCode, before: UserCode | None) -> None:
    """Raises StudyError for a name that the project or another file uses."""
    if name in project:
        raise StudyError(f"{noun} '{name}' is one of the project's own; give yours another name")
    if before is not None and before.path != file.path:
        raise StudyError(f"{noun} '{name}' is defined in {before.path} and in {file.path}; rename one of them")


def forget() -> None:
    """Removes the methods and laws of all files."""
    _METHODS.clear()
    _LAWS.clear()


def sprung_by(body: Body, law: StiffnessLaw, mu: float) -> Body:
    """A tetrahedral body with the springs of a user's law; mu [Pa] of its tissue. Raises StudyError for stiffnesses
    that are not one finite number per edge."""
    edges = Edges(body.rest, body.tetrahedra)
    stiffness = np.ascontiguousarray(law.stiffness(edges, mu), dtype=np.float64)
    if stiffness.shape != edges.length.shape or not np.isfinite(stiffness).all():
        raise StudyError(
            f"law '{law.name}' gives stiffnesses of shape {stiffness.shape}, {(~np.isfinite(stiffness)).sum()} of them "
            f"not finite; give one number [N/m] for each of {len(edges.length)} edges"
        )
    length = edges.length if law.rest_length else np.zeros(len(stiffness))
    springs = replace(body.springs, rest_length=length, stiffness=stiffness)
    return replace(body, springs=springs, law=law.name, rest_pressure=0.0 if law.rest_length else mu)
