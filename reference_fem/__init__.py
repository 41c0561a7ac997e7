"""Nearly incompressible finite elements: the reference that the mass-spring models are judged by."""

from reference_fem.dynamics.modes import Modes, natural_frequencies
from reference_fem.dynamics.motion_path import DynamicsSettings, Moment, motion_path
from reference_fem.elements.curve import curve
from reference_fem.elements.evaluate import Evaluator
from reference_fem.elements.shapes import facet_nodes, nodes, surface_triangles
from reference_fem.elements.table import ELEMENTS, Element
from reference_fem.errors import ReferenceProblem, SlowSolverWarning
from reference_fem.model.cavity import Cavity
from reference_fem.model.loads import BodyForce, Traction
from reference_fem.model.material import Material, MooneyRivlin, NeoHookean
from reference_fem.model.obstacles import RigidCapsule, RigidPlane, RigidSphere
from reference_fem.model.problem import Held, Problem
from reference_fem.statics.equilibrium import Checkpoint, Equilibrium, equilibrium_path
from reference_fem.system.state import NewtonSettings, State

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
