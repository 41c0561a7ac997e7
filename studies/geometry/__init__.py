"""Meshes of organs. Lengths are in metres, and surface nodes are numbered first.

The public names are those in the stub `__init__.pyi`. Each name loads its module on first use.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
