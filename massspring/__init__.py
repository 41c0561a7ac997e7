"""Mass-spring bodies that keep their volume: Jung, Hong, Choi (2005). Knows no file, no plot, no scene."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from massspring.analysis.stability import StepLimit, step_limit
    from massspring.body.body import Body, Material
    from massspring.body.build import surface_body, tetrahedral_body
    from massspring.body.membranes import membrane_body
    from massspring.body.volumes import Volumes
    from massspring.errors import MassSpringError
    from massspring.layout.state import State
    from massspring.methods import METHODS
    from massspring.methods.barycentre import Barycentre
    from massspring.methods.baumgarte import Baumgarte
    from massspring.methods.element import Element
    from massspring.methods.free import Free
    from massspring.methods.implicit_springs import ImplicitSprings
    from massspring.methods.implicit_volume import ImplicitVolume
    from massspring.methods.method import Method
    from massspring.methods.penalty import Penalty
    from massspring.methods.post_stabilization import PostStabilization
    from massspring.methods.pressure import Pressure
    from massspring.methods.projection import Projection
    from massspring.methods.pyramid import Pyramid
    from massspring.methods.shake import Shake
    from massspring.methods.xpbd import Xpbd
    from massspring.run.history import History
    from massspring.run.simulation import Setup, simulate
    from massspring.world.clock import Clock, make_clock
    from massspring.world.obstacles import Attachment, Capsule, Obstacle, Plane, Probe, Sphere
    from massspring.world.trajectories import Path, Ramp

_FACE = {
    "METHODS": "massspring.methods",
    "Attachment": "massspring.world.obstacles",
    "Barycentre": "massspring.methods.barycentre",
    "Baumgarte": "massspring.methods.baumgarte",
    "Body": "massspring.body.body",
    "Capsule": "massspring.world.obstacles",
    "Clock": "massspring.world.clock",
    "Element": "massspring.methods.element",
    "Free": "massspring.methods.free",
    "History": "massspring.run.history",
    "ImplicitSprings": "massspring.methods.implicit_springs",
    "ImplicitVolume": "massspring.methods.implicit_volume",
    "MassSpringError": "massspring.errors",
    "Material": "massspring.body.body",
    "Method": "massspring.methods.method",
    "Obstacle": "massspring.world.obstacles",
    "Path": "massspring.world.trajectories",
    "Penalty": "massspring.methods.penalty",
    "Plane": "massspring.world.obstacles",
    "PostStabilization": "massspring.methods.post_stabilization",
    "Pressure": "massspring.methods.pressure",
    "Probe": "massspring.world.obstacles",
    "Projection": "massspring.methods.projection",
    "Pyramid": "massspring.methods.pyramid",
    "Ramp": "massspring.world.trajectories",
    "Setup": "massspring.run.simulation",
    "Shake": "massspring.methods.shake",
    "Sphere": "massspring.world.obstacles",
    "State": "massspring.layout.state",
    "StepLimit": "massspring.analysis.stability",
    "Volumes": "massspring.body.volumes",
    "Xpbd": "massspring.methods.xpbd",
    "make_clock": "massspring.world.clock",
    "membrane_body": "massspring.body.membranes",
    "simulate": "massspring.run.simulation",
    "step_limit": "massspring.analysis.stability",
    "surface_body": "massspring.body.build",
    "tetrahedral_body": "massspring.body.build",
}
"""Where each name lives; its module is loaded when the name is asked for (PEP 562)."""

if not TYPE_CHECKING:
    __all__ = list(_FACE)

    def __getattr__(name: str) -> Any:
        if name not in _FACE:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = globals()[name] = getattr(import_module(_FACE[name]), name)
        return value

    def __dir__() -> list[str]:
        return sorted({*globals(), *_FACE})
