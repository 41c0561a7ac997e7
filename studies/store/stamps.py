"""Marks on results that no record stands behind: by which code they were made."""

import json
from pathlib import Path

from massspring.sources import own_modules, source_hashes
from studies.base.atomic import write_whole


def set_stamp(root: Path, name: str) -> None:
    """Notes that the present code has just written `root`/`name`. Raises StudyError when it cannot be noted."""
    write_whole(_path(root, name), json.dumps(source_hashes(*own_modules())).encode())


def is_stamped(root: Path, name: str, makers: tuple[str, ...]) -> bool:
    """Whether the modules `makers`, and all that they import, are as they were when `root`/`name` was written."""
    path = _path(root, name)
    if not path.is_file():
        return False
    try:
        noted = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        return False  # cut off, or of an earlier release
    return isinstance(noted, dict) and noted.items() >= source_hashes(*makers).items()


def _path(root: Path, name: str) -> Path:
    return root / "cache" / f"{name}.made"
