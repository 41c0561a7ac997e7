"""Python files of a user: loaded under a name of their own, and known by what they say.

The name holds the content, and the state of the project's code that the file imports: numba keeps compiled functions by
the name of their module, so a loop of a user is never one that was compiled from other code.
"""

import hashlib
import sys
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType

from massspring.errors import MassSpringError
from massspring.sources import own_file, read_source, source_fingerprint

PREFIX = "organbench_own_"
"""Of the names of their modules."""


@dataclass(frozen=True)
class OwnFile:
    """A file of a user, as it was when it was read."""

    path: Path
    content: bytes
    fingerprint: str
    """SHA-256 (hex) of what it says without comments and docstrings, with the modules beside it and those of this
    project that it imports."""

    @property
    def sha256(self) -> str:
        """Of its bytes (hex)."""
        return hashlib.sha256(self.content).hexdigest()

    @property
    def module(self) -> str:
        """The name under which it is loaded."""
        given = f"{self.path}\0{self.sha256}\0{self.fingerprint}"
        return PREFIX + hashlib.sha256(given.encode()).hexdigest()[:16]


_LOADED: dict[str, OwnFile] = {}


def read_own(path: Path, content: bytes | None = None) -> OwnFile:
    """The file at `path`, with `content` instead of what it holds now where that is given.

    Raises OSError where it cannot be read. A file that is no Python is known by its bytes alone.
    """
    path = path.resolve()
    content = path.read_bytes() if content is None else content
    digest = hashlib.sha256()
    for part in _meaning(path, content):
        digest.update(part.encode() + b"\0")
    return OwnFile(path, content, digest.hexdigest())


def _meaning(path: Path, content: bytes) -> Iterator[str]:
    """Hashes of the file, of the modules beside it, of the project's modules that any of them imports, and of the
    kernels, which a face may pass on."""
    waiting, seen, ours = [(path, content)], {path}, set[str]()
    while waiting:
        file, text = waiting.pop()
        try:
            source = read_source(text, file.stem, file)
        except MassSpringError:
            yield hashlib.sha256(text).hexdigest()
            continue
        yield f"{file.relative_to(path.parent)} {source.meaning}"
        for module, name in source.imports:
            ours.update(part for part in (module, f"{module}.{name}") if own_file(part) is not None)
            beside = [other for other in _beside(path.parent, module.split(".")[0]) if other not in seen]
            seen.update(beside)
            waiting += [(other, other.read_bytes()) for other in beside]
    yield source_fingerprint("massspring.methods", *sorted(ours))


def _beside(folder: Path, name: str) -> list[Path]:
    """The files of a module, or of a package, in a folder."""
    if not name or own_file(name) is not None:
        return []
    alone = folder / f"{name}.py"
    return [alone] if alone.is_file() else sorted((folder / name).rglob("*.py"))


def load_own(file: OwnFile) -> ModuleType:
    """Its module, executed anew. Whatever it raises passes through."""
    module = ModuleType(file.module)
    module.__file__ = str(file.path)
    sys.modules[file.module] = module  # its own dataclasses look themselves up there
    _LOADED[file.module] = file
    # What was read is executed: the loader would read the file again, or take a compiled one of the same second.
    exec(compile(file.content, str(file.path), "exec"), vars(module))
    return module


def file_of(thing: object) -> OwnFile | None:
    """The file of a user in which a function or class was written; None for those of this project or a notebook."""
    name = str(getattr(thing, "__module__", ""))
    if name in _LOADED:
        return _LOADED[name]
    return None if own_file(name) is not None else _file_of_module(name)


@cache
def _file_of_module(name: str) -> OwnFile | None:
    """Of a module that the user's Python itself has imported."""
    file = getattr(sys.modules.get(name), "__file__", None)
    return read_own(Path(file)) if file is not None and Path(file).is_file() else None


def loaded_from(error: BaseException) -> OwnFile | None:
    """The loaded file that an error passed through; None for an error of the project."""
    passed = {frame.filename for frame in traceback.extract_tb(error.__traceback__)}
    return next((file for file in _LOADED.values() if str(file.path) in passed), None)


def line_of(path: Path, error: BaseException) -> int | None:
    """The last line of a file that an error passed through; None where it did not."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    return lines[-1] if lines else None


def fault_of_own(error: Exception) -> str | None:
    """ "mine.py fails: ZeroDivisionError in line 4: division by zero", for an error that passed through a loaded file;
    None for another."""
    file = loaded_from(error)
    if file is None:
        return None
    line, message = line_of(file.path, error), str(error).split("\n")[0]
    return f"{file.path.name} fails: {type(error).__name__} in line {line}" + (f": {message}" if message else "")
