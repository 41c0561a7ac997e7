"""Mass-spring bodies that keep their volume: Jung, Hong, Choi (2005). It reads no files, draws no plots and has no
notion of a scene.

Only `massspring.sources` names the other packages of this distribution: it computes hashes of their code.

The public names are those in the stub `__init__.pyi` and the methods. Each name loads its module on first use.
"""

from importlib import import_module
from typing import Any

import lazy_loader

_public, __dir__, _listed = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    """A public name, `__all__`, or the version of the installed distribution. Raises AttributeError for any other."""
    if name == "__version__":
        return import_module("importlib.metadata").version("organbench")
    if name in _listed or (name.startswith("_") and name != "__all__"):
        return _public(name)
    methods = import_module("massspring.methods")
    others = {method.__name__: method for method in (*methods.METHODS, *methods.LITERATURE)}
    return sorted({*_listed, *others}) if name == "__all__" else others.get(name) or _public(name)
