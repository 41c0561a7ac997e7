"""Nearly incompressible finite elements: the reference that the mass-spring models are judged by."""

import hashlib
import os
from pathlib import Path

from numba.core import config


def cache_folder() -> Path:
    """Where compiled kernels are kept: numba does not notice edits in imported files, so the name hashes them all."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(source.name.encode() + source.read_bytes())
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "organbench" / f"numba-{digest.hexdigest()[:16]}"


# numba reads the folder when a function is decorated, so it is set around the imports and given back afterwards;
# a folder that the user chose stays.
_folder_before = config.CACHE_DIR  # pyright: ignore[reportAttributeAccessIssue]
if "NUMBA_CACHE_DIR" not in os.environ:
    config.CACHE_DIR = str(cache_folder())  # pyright: ignore[reportAttributeAccessIssue]

from reference_fem.dynamics.modes import Modes, natural_frequencies  # noqa: E402
from reference_fem.dynamics.motion_path import DynamicsSettings, Moment, motion_path  # noqa: E402
from reference_fem.elements.curve import curve  # noqa: E402
from reference_fem.elements.evaluate import Evaluator  # noqa: E402
from reference_fem.elements.shapes import facet_nodes, nodes, surface_triangles  # noqa: E402
from reference_fem.elements.table import ELEMENTS, Element  # noqa: E402
from reference_fem.errors import ReferenceProblem, SlowSolverWarning  # noqa: E402
from reference_fem.model.cavity import Cavity  # noqa: E402
from reference_fem.model.loads import BodyForce, Traction  # noqa: E402
from reference_fem.model.material import Material, MooneyRivlin, NeoHookean  # noqa: E402
from reference_fem.model.obstacles import RigidCapsule, RigidPlane, RigidSphere  # noqa: E402
from reference_fem.model.problem import Held, Problem  # noqa: E402
from reference_fem.statics.equilibrium import Checkpoint, Equilibrium, equilibrium_path  # noqa: E402
from reference_fem.system.state import NewtonSettings, State  # noqa: E402

config.CACHE_DIR = _folder_before  # pyright: ignore[reportAttributeAccessIssue]

__all__ = [
    "ELEMENTS",
    "BodyForce",
    "Cavity",
    "Checkpoint",
    "DynamicsSettings",
    "Element",
    "Equilibrium",
    "Evaluator",
    "Held",
    "Material",
    "Modes",
    "Moment",
    "MooneyRivlin",
    "NeoHookean",
    "NewtonSettings",
    "Problem",
    "ReferenceProblem",
    "RigidCapsule",
    "RigidPlane",
    "RigidSphere",
    "SlowSolverWarning",
    "State",
    "Traction",
    "curve",
    "equilibrium_path",
    "facet_nodes",
    "motion_path",
    "natural_frequencies",
    "nodes",
    "surface_triangles",
]
