"""Questions asked of both solvers: scenes, runs, metrics, results and charts. What a user imports is here.

The public names are those of the stub, `__init__.pyi`; a name loads its module when it is first used.
"""

from importlib import import_module
from typing import Any

import lazy_loader

_public, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    """A public name, or the version of the installed distribution. Raises AttributeError for any other."""
    return import_module("importlib.metadata").version("organbench") if name == "__version__" else _public(name)
