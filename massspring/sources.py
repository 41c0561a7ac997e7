"""The state of the code as one number: a result, a mesh or compiled code is current while the number stays the same.

The number of a module covers the bytes of its file, and of the files of all own modules that it imports, directly or
through others. So an edit makes stale only what can depend on it.
"""

import ast
import hashlib
import os
from collections.abc import Iterator
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

    digest: str
    """SHA-256 of its file (hex)."""
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
    sources: dict[str, Source] = {}
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        if name not in sources:
            sources[name] = _source(name)
            waiting += [other for other in _followed(name) if _counts(other, within)]
    return hashlib.sha256("".join(f"{name}\0{sources[name].digest}\0" for name in sorted(sources)).encode()).hexdigest()


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
    stub = _stub(module)
    return read_source(file.read_bytes(), module, file, stub.read_bytes() if stub.is_file() else b"")


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
    return Source(hashlib.sha256(content).hexdigest(), imports, exports)


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
        elif not isinstance(node, ast.expr):
            yield from _imports(node, package)
