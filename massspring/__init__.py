"""Mass-spring bodies that keep their volume: Jung, Hong, Choi (2005). Knows no file, no plot, no scene."""

from massspring.analysis.stability import StepLimit, step_limit
from massspring.body.body import Body, Material
from massspring.body.build import surface_body, tetrahedral_body
from massspring.body.membranes import membrane_body
from massspring.body.volumes import Volumes
from massspring.errors import MassSpringError
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
from massspring.run.history import History
from massspring.run.simulation import Setup, simulate
from massspring.world.clock import Clock, make_clock
from massspring.world.obstacles import Attachment, Capsule, Obstacle, Plane, Probe, Sphere
from massspring.world.trajectories import Path, Ramp

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
