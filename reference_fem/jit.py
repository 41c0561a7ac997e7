"""numba with a cache of its own: compiled kernels are kept under a key that changes when any source changes."""

import hashlib
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import config


@cache
def cache_folder() -> Path:
    """Where compiled kernels are kept: numba does not notice edits in imported files, so the name hashes them all."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(source.name.encode() + source.read_bytes())
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "organbench" / f"numba-{digest.hexdigest()[:16]}"


def njit(**options: Any) -> Callable[[Any], Any]:
    """numba.njit, kept in `cache_folder`; a folder that the user chose by NUMBA_CACHE_DIR stays."""

    def decorate(function: Any) -> Any:
        if "NUMBA_CACHE_DIR" in os.environ:
            return numba.njit(**options)(function)
        # numba reads its folder while it decorates; other packages in the process keep theirs.
        before = config.CACHE_DIR  # pyright: ignore[reportAttributeAccessIssue]
        config.CACHE_DIR = str(cache_folder())  # pyright: ignore[reportAttributeAccessIssue]
        try:
            return numba.njit(**options)(function)
        finally:
            config.CACHE_DIR = before  # pyright: ignore[reportAttributeAccessIssue]

    return decorate
