"""Nearly incompressible finite elements: the reference that the mass-spring models are judged by."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from reference_fem.dynamics.modes import Modes, natural_frequencies
    from reference_fem.dynamics.motion_path import DynamicsSettings, Moment, motion_path
    from reference_fem.elements.curve import curve
    from reference_fem.elements.evaluate import Evaluator
    from reference_fem.elements.shapes import facet_nodes, nodes, surface_triangles
    from reference_fem.elements.table import ELEMENTS, Element
    from reference_fem.errors import SlowSolverWarning, SolveError
    from reference_fem.model.cavity import Cavity
    from reference_fem.model.loads import BodyForce, Traction
    from reference_fem.model.material import Material, MooneyRivlin, NeoHookean
    from reference_fem.model.obstacles import RigidCapsule, RigidPlane, RigidSphere
    from reference_fem.model.problem import PrescribedDisplacement, Problem
    from reference_fem.statics.equilibrium import Checkpoint, Equilibrium, equilibrium_path
    from reference_fem.system.state import NewtonSettings, State

    __version__: str

_FACE = {
    "ELEMENTS": "reference_fem.elements.table",
    "BodyForce": "reference_fem.model.loads",
    "Cavity": "reference_fem.model.cavity",
    "Checkpoint": "reference_fem.statics.equilibrium",
    "DynamicsSettings": "reference_fem.dynamics.motion_path",
    "Element": "reference_fem.elements.table",
    "Equilibrium": "reference_fem.statics.equilibrium",
    "Evaluator": "reference_fem.elements.evaluate",
    "Material": "reference_fem.model.material",
    "Modes": "reference_fem.dynamics.modes",
    "Moment": "reference_fem.dynamics.motion_path",
    "MooneyRivlin": "reference_fem.model.material",
    "NeoHookean": "reference_fem.model.material",
    "NewtonSettings": "reference_fem.system.state",
    "PrescribedDisplacement": "reference_fem.model.problem",
    "Problem": "reference_fem.model.problem",
    "RigidCapsule": "reference_fem.model.obstacles",
    "RigidPlane": "reference_fem.model.obstacles",
    "RigidSphere": "reference_fem.model.obstacles",
    "SlowSolverWarning": "reference_fem.errors",
    "SolveError": "reference_fem.errors",
    "State": "reference_fem.system.state",
    "Traction": "reference_fem.model.loads",
    "curve": "reference_fem.elements.curve",
    "equilibrium_path": "reference_fem.statics.equilibrium",
    "facet_nodes": "reference_fem.elements.shapes",
    "motion_path": "reference_fem.dynamics.motion_path",
    "natural_frequencies": "reference_fem.dynamics.modes",
    "nodes": "reference_fem.elements.shapes",
    "surface_triangles": "reference_fem.elements.shapes",
}
"""Where each name lives; its module is loaded when the name is asked for (PEP 562)."""

if not TYPE_CHECKING:
    __all__ = list(_FACE)

    def __getattr__(name: str) -> Any:
        if name == "__version__":
            return import_module("importlib.metadata").version("organbench")
        if name not in _FACE:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = globals()[name] = getattr(import_module(_FACE[name]), name)
        return value

    def __dir__() -> list[str]:
        return sorted({*globals(), *_FACE})
