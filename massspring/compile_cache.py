"""The cache of compiled code between processes: its folder, and when an entry is out of date.

numba itself compares only the file of a function, ignores the files that it imports, and recompiles after a changed
comment. Here the hash of all code that can be compiled into a function decides (massspring.sources).
"""

import contextlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from numba.core import caching, config

from massspring.sources import cache_folder, own_file, source_fingerprint

COMPILED = ("massspring.kernels", "massspring.methods", "reference_fem")
"""Packages that define compiled functions and their constants; a compiled function uses nothing else (tested)."""

ARGUMENTS = (
    "massspring.kernels.arrays.volume_rows",
    "massspring.kernels.arrays.face_pairs",
    "massspring.kernels.constraint.exact_volume",
    "massspring.kernels.constraint.ldl_solve",
    "massspring.kernels.forces.elements",
    "massspring.kernels.forces.tetrahedron_volumes",
    "massspring.kernels.points.arrays",
    "massspring.kernels.step.frame",
)
"""Modules that define, or import, the named tuples that kernels take as arguments.

A kernel need not import the type of its argument, and numba identifies a named tuple by its name and field types. If
two fields of one type change places, cached code would confuse them. Functions of the reference import the types of
their arguments.
"""


def folder() -> Path:
    """NUMBA_CACHE_DIR where the user set it, else a folder of the user's cache."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    return Path(chosen) if chosen else cache_folder() / "compiled"


_ready: set[str] = set()
"""Cache folders that this process has made, or has found to be writable."""


class BySource(caching.UserProvidedCacheLocator):
    """numba's locator for functions of this distribution: a folder for each state of the code of a module."""

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        super().__init__(py_func, py_file)
        module = py_func.__module__
        given = ARGUMENTS if module.startswith("massspring.") else ()
        self._stamp = source_fingerprint(module, *given, within=COMPILED)
        self._cache_path = os.path.join(config.CACHE_DIR, f"{module}-{self._stamp[:16]}")  # pyright: ignore[reportAttributeAccessIssue]

    def ensure_cache_path(self) -> None:
        """Makes the folder, once for all functions of a module. Raises OSError."""
        if self._cache_path not in _ready:
            super().ensure_cache_path()
            _ready.add(self._cache_path)

    def get_source_stamp(self) -> str:
        """Hash of the code that a cache entry must have been compiled from."""
        return self._stamp

    def get_disambiguator(self) -> str:
        """Nothing: a line number would change with the comments above the function."""
        return ""

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> "BySource | None":
        """None for functions of other packages: numba's default locators serve those."""
        if own_file(py_func.__module__) is None:
            return None
        return super().from_function(py_func, py_file)  # pyright: ignore[reportReturnType]


LOCATORS = f"{__name__}.{BySource.__name__}"
OTHERS = ",".join(locator.__name__ for locator in caching.CacheImpl._locator_classes)


@contextlib.contextmanager
def kept() -> Iterator[None]:
    """Inside, numba's decorators use this cache for functions of this distribution, and its defaults for others."""
    before = config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES  # pyright: ignore[reportAttributeAccessIssue]
    config.CACHE_DIR = str(folder())  # pyright: ignore[reportAttributeAccessIssue]
    config.CACHE_LOCATOR_CLASSES = f"{LOCATORS},{OTHERS}"  # pyright: ignore[reportAttributeAccessIssue]
    try:
        yield
    finally:
        config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = before  # pyright: ignore[reportAttributeAccessIssue]
