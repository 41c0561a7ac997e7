"""Marks on results that no record stands behind: whether the present code made them."""

from pathlib import Path

from massspring.sources import own_modules, source_fingerprint
from studies.base.atomic import write_whole


def set_stamp(root: Path, name: str) -> None:
    """Notes that the present code has just written `root`/`name`. Raises StudyError when it cannot be noted."""
    write_whole(_path(root, name), _code().encode())


def is_stamped(root: Path, name: str) -> bool:
    """Whether `root`/`name` was written by the present code."""
    path = _path(root, name)
    return path.is_file() and path.read_text(encoding="utf-8") == _code()


def _path(root: Path, name: str) -> Path:
    return root / "cache" / f"{name}.made"


def _code() -> str:
    return source_fingerprint(*own_modules())
