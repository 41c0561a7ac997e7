"""Nearly incompressible finite elements: the reference that the mass-spring models are judged by."""

import hashlib
import os
from pathlib import Path

from numba.core import config


def cache_folder() -> Path:
    """Where compiled kernels are kept: numba does not notice edits in imported files, so the name hashes them all."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode() + source.read_bytes())
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "organbench" / f"numba-{digest.hexdigest()[:16]}"


# numba reads the folder when a function is decorated, so it is set around the imports and given back afterwards;
# a folder that the user chose stays.
_folder_before = config.CACHE_DIR  # pyright: ignore[reportAttributeAccessIssue]
if "NUMBA_CACHE_DIR" not in os.environ:
    config.CACHE_DIR = str(cache_folder())  # pyright: ignore[reportAttributeAccessIssue]

from reference_fem.cavity import Cavity  # noqa: E402
from reference_fem.dynamics import DynamicsSettings, Moment, motion_path  # noqa: E402
from reference_fem.element_table import ELEMENTS, Element  # noqa: E402
from reference_fem.elements import facet_nodes, nodes, surface_triangles  # noqa: E402
from reference_fem.equilibrium import Checkpoint, Equilibrium, equilibrium_path  # noqa: E402
from reference_fem.errors import ReferenceProblem, SlowSolverWarning  # noqa: E402
from reference_fem.evaluate import Evaluator  # noqa: E402
from reference_fem.loads import BodyForce, Traction  # noqa: E402
from reference_fem.material import Material, MooneyRivlin, NeoHookean  # noqa: E402
from reference_fem.mesh import curve  # noqa: E402
from reference_fem.modes import Modes, natural_frequencies  # noqa: E402
from reference_fem.obstacles import RigidCapsule, RigidPlane, RigidSphere  # noqa: E402
from reference_fem.problem import Held, Problem  # noqa: E402
from reference_fem.state import NewtonSettings, State  # noqa: E402

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
