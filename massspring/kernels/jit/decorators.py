"""The decorator of all kernels: numba, cached on disk under a key that changes when any kernel source changes."""

import contextlib
import hashlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import config

PACKAGE = Path(__file__).resolve().parents[2]
Function = TypeVar("Function", bound=Callable[..., Any])


def source_key() -> str:
    """Hash of the sources that end up in compiled code: numba itself only notices edits in the file it compiles."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted([*(PACKAGE / "kernels").rglob("*.py"), *(PACKAGE / "methods").rglob("*.py")]):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:12]


def _cache_folder() -> str:
    """NUMBA_CACHE_DIR where the user set it, else a folder of the user's cache named after the sources."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        return str(Path(chosen) / f"massspring-{source_key()}")
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return str(home / "organbench" / f"massspring-{source_key()}")


CACHE_FOLDER = _cache_folder()


@contextlib.contextmanager
def _keyed_cache() -> Iterator[None]:
    """numba reads its folder while it decorates; other packages in the process keep theirs."""
    before = config.CACHE_DIR  # pyright: ignore[reportAttributeAccessIssue]
    config.CACHE_DIR = CACHE_FOLDER  # pyright: ignore[reportAttributeAccessIssue]
    try:
        yield
    finally:
        config.CACHE_DIR = before  # pyright: ignore[reportAttributeAccessIssue]


OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True}
"""Kept on disk; division follows IEEE: a zero gives inf, and the run has diverged; other threads run meanwhile."""


def _jit(function: Function, **options: Any) -> Function:
    with _keyed_cache():
        return numba.njit(**OPTIONS, **options)(function)  # pyright: ignore[reportReturnType]


def compiled(function: Function) -> Function:
    """Compile on first call."""
    return _jit(function)


def lean(function: Function) -> Function:
    """As `compiled`, without numba's runtime: what would allocate memory or make an array does not compile.

    No references are counted. With them a call that is given a tuple of twenty arrays takes 200 ns, of a step's 15 µs.
    """
    return _jit(function, _nrt=False)


def inlined(function: Function) -> Function:
    """As `lean`, and always part of its caller."""
    return _jit(function, _nrt=False, forceinline=True)


def comparing(function: Function) -> Function:
    """As `inlined`, for maxima along arrays of numbers: a vector register compares several. NaN makes them anything."""
    return _jit(function, _nrt=False, forceinline=True, fastmath={"nnan", "nsz"})


def summing(function: Function) -> Function:
    """As `inlined`, for sums along arrays: terms may be added in any order, so that a vector register adds several."""
    return _jit(function, _nrt=False, forceinline=True, fastmath={"reassoc", "contract"})
