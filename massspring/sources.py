"""The state of the code as one number: a result, a mesh or compiled code is current while the number stays the same.

The number of a module covers its own syntax tree, without docstrings, and those of all own modules that it imports,
directly or through others. So an edit makes stale only what can depend on it, and new words make nothing
stale.
"""

import ast
import hashlib
import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import NamedTuple

from massspring.errors import MassSpringError

OWN = ("massspring", "reference_fem", "studies")
"""The packages of this distribution, installed together; of other packages the versions count."""
APART = (
    "massspring.compile_cache",
    "massspring.compile_parts",
    "massspring.sources",
    "studies.base.atomic",
    "studies.store",
)
"""Own modules that track code or files, and change no result: a record has a schema number of its own."""
ROOT = Path(__file__).parents[1]


class Source(NamedTuple):
    """The content of a module, read from its text."""

    meaning: str
    """SHA-256 of its syntax tree without docstrings (hex)."""
    imports: list[tuple[str, str]]
    """(module, name) of each name that is imported; an empty name for the module itself."""
    exports: dict[str, str]
    """Module of each name that it exports again."""


@cache
def source_fingerprint(*modules: str, within: tuple[str, ...] = OWN) -> str:
    """SHA-256 (hex) over `modules`, by dotted name, and all that they import of the packages or modules `within`.

    Read once per process: a running process computes with the code that it has loaded.
    Raises MassSpringError for a module that does not exist, or is no Python.
    """
    digest = hashlib.sha256()
    for name, meaning in sorted(source_hashes(*modules, within=within).items()):
        digest.update(f"{name}\0{meaning}\0".encode())
    return digest.hexdigest()


def source_hashes(*modules: str, within: tuple[str, ...] = OWN) -> dict[str, str]:
    """The hash of each module that `source_fingerprint` covers, by dotted name. Raises the same."""
    sources: dict[str, Source] = {}
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        if name in sources:
            continue
        sources[name] = _source(name)
        waiting += [other for other in _followed(name) if _counts(other, within)]
    _memory().keep()
    return {name: source.meaning for name, source in sources.items()}


def own_file(module: str) -> Path | None:
    """The file of an own module or package; None where there is none."""
    return _file_below(ROOT, module)


@cache
def _file_below(root: Path, module: str) -> Path | None:
    if module.split(".")[0] not in OWN:
        return None
    path = root.joinpath(*module.split("."))
    candidates = (path.with_suffix(".py"), path / "__init__.py")
    return next((file for file in candidates if file.is_file()), None)


@cache
def own_modules() -> tuple[str, ...]:
    """All modules of this distribution, by dotted name: for what depends on more than imports say."""
    files = [file for package in OWN for file in sorted((ROOT / package).rglob("*.py"))]
    return tuple(".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for file in files)


@cache
def _counts(module: str, within: tuple[str, ...]) -> bool:
    return _is_within(module, within) and not _is_within(module, APART)


def _is_within(module: str, within: tuple[str, ...]) -> bool:
    return any(module == part or module.startswith(part + ".") for part in within)


@cache
def _followed(module: str) -> frozenset[str]:
    """The modules that the names it imports come from; for a name that a package only exports again, its origin."""
    imports = _source(module).imports
    return frozenset(_origin(other, name) for other, name in imports if own_file(other) is not None)


def _stub(module: str) -> Path:
    """The file in which a package lists its public names, if it has one."""
    return (own_file(module) or ROOT).with_suffix(".pyi")


def _origin(module: str, name: str) -> str:
    if name and own_file(f"{module}.{name}") is not None:
        return f"{module}.{name}"
    exports = _source(module).exports
    passed_on = exports.get(name, exports.get("*") if name else None)
    if name not in ("", "*") and passed_on is None and (stub := _stub(module)).is_file():
        raise MassSpringError(
            f"{module} has no public name {name!r}: add it to {stub.name}, or import it from its module"
        )
    return module if passed_on is None or own_file(passed_on) is None else _origin(passed_on, name)


@cache
def _source(module: str) -> Source:
    file = own_file(module)
    if file is None:
        raise MassSpringError(f"there is no module {module!r} in {', '.join(OWN)}: its state cannot be known")
    return _memory().get(module, file)


class _Memory:
    """The cache of `Source` entries, by the hash of the bytes of a file: parsing all files takes a second."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.grown = False
        self.entries: dict[str, list] = {}
        with suppress(OSError, ValueError):
            stored = json.loads(path.read_text(encoding="utf-8"))
            self.entries = stored if isinstance(stored, dict) and len(stored) < MOST else {}

    def get(self, module: str, file: Path) -> Source:
        content, stub = file.read_bytes(), _stub(module)
        public = stub.read_bytes() if stub.is_file() else b""
        key = hashlib.sha256(f"{VERSION} {module} {file.name}\0".encode() + content + public).hexdigest()
        if key not in self.entries:
            self.entries[key] = list(read_source(content, module, file, public))
            self.grown = True
        meaning, imports, exports = self.entries[key]
        return Source(meaning, [(pair[0], pair[1]) for pair in imports], exports)

    def keep(self) -> None:
        """Writes the cache, whole or not at all; where it cannot be, the next process parses all files again."""
        if not self.grown:
            return
        self.grown = False
        with suppress(OSError):
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.NamedTemporaryFile("w", dir=self.path.parent, suffix=".part", delete=False) as part:
                json.dump(self.entries, part)
            os.replace(part.name, self.path)


VERSION = 2
"""Of the entries in the cache."""
MOST = 20_000
"""Entries of the cache; with more it starts empty, since most belong to old versions."""


@cache
def _memory() -> _Memory:
    return _Memory(cache_folder() / "sources.json")


def cache_folder() -> Path:
    """Folder of the user's cache for what can be made again: $XDG_CACHE_HOME/organbench, or ~/.cache/organbench."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "organbench"


def read_source(content: bytes, module: str, file: Path, stub: bytes = b"") -> Source:
    """What the text of `module` says; a package that loads its names lazily lists them in a stub.

    Raises MassSpringError for a text that is no Python.
    """
    try:
        tree = ast.parse(content)
    except SyntaxError as error:
        raise MassSpringError(f"{file} is not valid Python ({error.msg}, line {error.lineno}): correct it") from error
    package = module if file.name == "__init__.py" else module.rpartition(".")[0]
    imports = sorted(set(_imports(tree, package)))
    public = _imports(ast.parse(stub), package)
    exports = {name: origin for origin, name in (*imports, *public) if name}
    _drop_docstrings(tree)
    return Source(hashlib.sha256(ast.dump(tree).encode()).hexdigest(), imports, exports)


def _imports(tree: ast.AST, package: str) -> Iterator[tuple[str, str]]:
    """(module, name) of every import, those inside functions too; those for the type checker alone left out."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package.rsplit(".", node.level - 1)[0] if node.level else ""
            module = ".".join(filter(None, (above, node.module)))
            yield from ((module, alias.name) for alias in node.names)
        else:
            yield from _imports(node, package)


def _drop_docstrings(tree: ast.AST) -> None:
    """Removes strings that are statements: docstrings, and those below a field or a constant."""
    for node in ast.walk(tree):
        for name in ("body", "orelse", "finalbody"):
            block = getattr(node, name, None)
            if isinstance(block, list):
                setattr(node, name, [statement for statement in block if not _is_remark(statement)])


def _is_remark(statement: ast.stmt) -> bool:
    value = statement.value if isinstance(statement, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)
