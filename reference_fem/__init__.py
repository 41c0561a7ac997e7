"""Nearly incompressible finite elements: the reference with which the mass-spring models are compared.

The public names are those in the stub `__init__.pyi`. Each name loads its module on first use.
"""

from importlib import import_module
from typing import Any

import lazy_loader

_public, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    """A public name, or the version of the installed distribution. Raises AttributeError for any other."""
    return import_module("importlib.metadata").version("organbench") if name == "__version__" else _public(name)
