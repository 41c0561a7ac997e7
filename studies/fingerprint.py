"""One number for the state of the code: a stored result is current only while it stays the same."""

import hashlib
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from studies.errors import StudyError


@cache
def source_fingerprint(*sources: str | Path) -> str:
    """SHA-256 (hex) over the Python sources of packages or modules (by dotted name), folders and files (by Path).

    It depends on what the files say and on their names inside their package, not on where the checkout lies, its
    dates or its line endings. Read once per process: a running process computes with the code it has loaded.
    Raises StudyError for a source that does not exist.
    """
    digest = hashlib.sha256()
    for source in sources:
        root = source if isinstance(source, Path) else _location(source)
        for file in _python_files(root):
            content = file.read_bytes().replace(b"\r\n", b"\n")
            label = f"{root.name}/{file.relative_to(root).as_posix()}" if root.is_dir() else file.name
            digest.update(f"{label}\0{len(content)}\0".encode())
            digest.update(content)
    return digest.hexdigest()


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
