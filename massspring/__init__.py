"""Mass-spring bodies that keep their volume: Jung, Hong, Choi (2005). Knows no file, no plot, no scene."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from massspring.analysis.stability import StepLimit, step_limit
    from massspring.body.body import Body, Material
    from massspring.body.build import surface_body, tetrahedral_body
    from massspring.body.membranes import membrane_body
    from massspring.body.quadratic import quadratic_body
    from massspring.body.volumes import Volumes
    from massspring.errors import MassSpringError
    from massspring.layout.state import State
    from massspring.methods import *  # noqa: F403
    from massspring.run.history import History
    from massspring.run.simulation import Setup, simulate
    from massspring.world.clock import Clock, make_clock
    from massspring.world.obstacles import Attachment, Capsule, Obstacle, Plane, Probe, Sphere
    from massspring.world.trajectories import Ramp, Trajectory

    __version__: str

_FACE = {
    "Attachment": "massspring.world.obstacles",
    "Body": "massspring.body.body",
    "Capsule": "massspring.world.obstacles",
    "Clock": "massspring.world.clock",
    "History": "massspring.run.history",
    "MassSpringError": "massspring.errors",
    "Material": "massspring.body.body",
    "Obstacle": "massspring.world.obstacles",
    "Plane": "massspring.world.obstacles",
    "Probe": "massspring.world.obstacles",
    "Ramp": "massspring.world.trajectories",
    "Setup": "massspring.run.simulation",
    "Sphere": "massspring.world.obstacles",
    "State": "massspring.layout.state",
    "StepLimit": "massspring.analysis.stability",
    "Trajectory": "massspring.world.trajectories",
    "Volumes": "massspring.body.volumes",
    "make_clock": "massspring.world.clock",
    "membrane_body": "massspring.body.membranes",
    "quadratic_body": "massspring.body.quadratic",
    "simulate": "massspring.run.simulation",
    "step_limit": "massspring.analysis.stability",
    "surface_body": "massspring.body.build",
    "tetrahedral_body": "massspring.body.build",
    "*": "massspring.methods",
}
"""Where each name lives; its module is loaded when the name is asked for (PEP 562). "*": every other public name."""

if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        if name == "__all__":
            home = import_module(_FACE["*"])
            return [
                *(name for name in _FACE if name != "*"),
                "LITERATURE",
                "METHODS",
                "Method",
                *(method.__name__ for method in (*home.METHODS, *home.LITERATURE)),
            ]
        if name == "__version__":
            return import_module("importlib.metadata").version("organbench")
        if name.startswith("_") or not hasattr(home := import_module(_FACE.get(name, _FACE["*"])), name):
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = globals()[name] = getattr(home, name)
        return value

    def __dir__() -> list[str]:
        return sorted({*globals(), *__getattr__("__all__")})
