"""One number for the state of the code: a stored result is current only while it stays the same."""

import ast
import hashlib
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from studies.base.errors import StudyError


@cache
def source_fingerprint(*sources: str | Path, without: tuple[str, ...] = ()) -> str:
    """SHA-256 (hex) over the Python sources of packages or modules (by dotted name), folders and files (by Path).

    It depends on what the code does and on file names inside their package: not on comments, docstrings, layout or
    line endings, nor on where the checkout lies. `without`: beginnings of paths inside packages ("name.py", "folder/")
    that do not count.
    Read once per process: a running process computes with the code it has loaded.
    Raises StudyError for a source that does not exist, or is no Python.
    """
    digest = hashlib.sha256()
    for source in sources:
        root = source if isinstance(source, Path) else _location(source)
        for file in _python_files(root):
            if root.is_dir() and file.relative_to(root).as_posix().startswith(without):
                continue
            content = _meaning(file)
            label = f"{root.name}/{file.relative_to(root).as_posix()}" if root.is_dir() else file.name
            digest.update(f"{label}\0{len(content)}\0".encode())
            digest.update(content)
    return digest.hexdigest()


@cache
def _meaning(file: Path) -> bytes:
    """The syntax tree of a file without the strings that stand by themselves."""
    try:
        tree = ast.parse(file.read_bytes())
    except SyntaxError as error:
        raise StudyError(f"{file} is no Python ({error.msg}, line {error.lineno}): mend it") from error
    for node in ast.walk(tree):
        for name in ("body", "orelse", "finalbody"):
            block = getattr(node, name, None)
            if isinstance(block, list):
                setattr(node, name, [statement for statement in block if not _is_remark(statement)])
    return ast.dump(tree).encode()


def _is_remark(statement: ast.stmt) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def _location(name: str) -> Path:
    try:
        spec = find_spec(name)
    except ModuleNotFoundError:
        spec = None
    if spec is None or spec.origin is None or not spec.has_location:
        raise StudyError(f"no Python source for {name!r}: give an importable package or module, or a Path")
    origin = Path(spec.origin)
    return origin.parent if origin.name == "__init__.py" else origin


def _python_files(root: Path) -> list[Path]:
    if root.is_file():
        return [root]
    files = sorted(root.rglob("*.py"), key=lambda file: file.relative_to(root).as_posix())
    if not files:
        raise StudyError(f"no Python source under {root}: a fingerprint of nothing would never go stale")
    return files
