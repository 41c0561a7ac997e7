"""Meshes of organs: gmsh and meshio live here only. Lengths in metres, surface nodes numbered first.

The public names are those of the stub, `__init__.pyi`; a name loads its module when it is first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
