"""Lazy faces of packages (PEP 562): a name of the face loads the module it lives in, the others stay unloaded."""

from __future__ import annotations

from importlib import import_module
from sys import modules

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any

DISTRIBUTION = "organbench"
"""Name under which pip knows the three packages."""


def lazy(package: str, face: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of `package`, whose names live where `face` says: name -> module.

    `__version__` is that of the installed distribution; reading it takes longer than loading a face.
    """

    def load(name: str) -> Any:
        if name == "__version__":
            return import_module("importlib.metadata").version(DISTRIBUTION)
        if name not in face:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(face[name]), name)
        setattr(modules[package], name, value)
        return value

    return load, lambda: sorted({*vars(modules[package]), *face})
