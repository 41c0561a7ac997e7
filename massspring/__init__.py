"""Mass-spring bodies that keep their volume: Jung, Hong, Choi (2005). Knows no file, no plot, no scene."""

from massspring.bodies import surface_body, tetrahedral_body
from massspring.body import Body, Material
from massspring.clock import Clock, make_clock
from massspring.errors import MassSpringError
from massspring.history import History
from massspring.membranes import membrane_body
from massspring.methods import (
    METHODS,
    Barycentre,
    Baumgarte,
    Element,
    Free,
    ImplicitSprings,
    ImplicitVolume,
    Method,
    Penalty,
    PostStabilization,
    Pressure,
    Projection,
    Pyramid,
    Shake,
    State,
    Xpbd,
)
from massspring.obstacles import Attachment, Capsule, Obstacle, Path, Plane, Probe, Sphere
from massspring.simulation import Setup, simulate
from massspring.stability import StepLimit, step_limit
from massspring.volumes import Ramp, Volumes

__all__ = [
    "METHODS",
    "Attachment",
    "Barycentre",
    "Baumgarte",
    "Body",
    "Capsule",
    "Clock",
    "Element",
    "Free",
    "History",
    "ImplicitSprings",
    "ImplicitVolume",
    "MassSpringError",
    "Material",
    "Method",
    "Obstacle",
    "Path",
    "Penalty",
    "Plane",
    "PostStabilization",
    "Pressure",
    "Probe",
    "Projection",
    "Pyramid",
    "Ramp",
    "Setup",
    "Shake",
    "Sphere",
    "State",
    "StepLimit",
    "Volumes",
    "Xpbd",
    "make_clock",
    "membrane_body",
    "simulate",
    "step_limit",
    "surface_body",
    "tetrahedral_body",
]
