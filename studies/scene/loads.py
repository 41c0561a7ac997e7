"""Scenes in one call: a probe or a plane that presses an organ, and clamped regions of which the last moves."""

from typing import Any

from massspring import Plane, Sphere, Trajectory
from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.geometry.organs import make_shape
from studies.geometry.shape.levelset import PalpationPoint
from studies.scene.placing import Vector, along, press_times, scaled
from studies.scene.scene import ForceOutput, Held, Organ, ReferencePlan, Scene
from studies.scene.tissues import TISSUES

GAP = 0.0005
"""Between a probe and the surface at the start [m]."""
STEPS = 5
"""Checkpoints of a press."""


def probed(
    organ: str, title: str, at: PalpationPoint, radius: float, depth: float, seconds: tuple[float, float], **more: Any
) -> Scene:
    """ORGAN_probe: a sphere is pushed `depth` into the surface at a point [m]; `seconds` and `more` as in `loaded`."""
    inward = scaled(at.normal, -1.0)
    path = moved(scaled(inward, depth + GAP), seconds[0])
    probe = Sphere(along(at.point, at.normal, radius + GAP), radius, path)
    return _touched(f"{organ}_probe", organ, title, probe, inward, seconds, **more)


def pressed(organ: str, title: str, at: Vector, depth: float, seconds: tuple[float, float], **more: Any) -> Scene:
    """ORGAN_press: a frictionless plane moves from a point by `depth` along the organ's direction of press [m];
    `seconds` and `more` as in `loaded`. Raises StudyError for an organ without such a direction."""
    inward = make_shape(organ, {}).press
    if inward is None:
        raise StudyError(f"the shape '{organ}' names no direction of press; choose another organ")
    plane = Plane(at, inward, moved(scaled(inward, depth), seconds[0]))
    return _touched(f"{organ}_press", organ, title, plane, inward, seconds, **more)


def clamped(
    name: str,
    organ: str | Organ,
    title: str,
    held: tuple[Held, ...],
    towards: Vector,
    seconds: tuple[float, float],
    **more: Any,
) -> Scene:
    """Held regions of which the last moves; its force along the unit vector `towards` is probed."""
    output = ForceOutput("held", len(held) - 1, towards)
    return loaded(name, organ, title, seconds, held=held, probed=output, **more)


def _touched(
    name: str,
    organ: str,
    title: str,
    obstacle: Sphere | Plane,
    inward: Vector,
    seconds: tuple[float, float],
    behind: tuple[Plane, ...] = (),
    **more: Any,
) -> Scene:
    output = ForceOutput("obstacle", 0, inward)
    return loaded(name, organ, title, seconds, obstacles=(obstacle, *behind), probed=output, **more)


def loaded(name: str, organ: str | Organ, title: str, seconds: tuple[float, float], **more: Any) -> Scene:
    """A scene with the usual reference whose load ends, and which ends, at these `seconds`.

    more: other fields of Scene, and those of these that differ.
    """
    usual: dict[str, Any] = {
        "organ": Organ(organ) if isinstance(organ, str) else organ,
        "duration": seconds[1],
        "checkpoints": press_times(0.0, seconds[0], STEPS, seconds[1]),
        "reference": ReferencePlan(),
    }
    if isinstance(organ, str):
        usual["tissue"] = lookup(organ, TISSUES, "tissue of an organ")
    return Scene(name=name, title=title, **(usual | more))


def held_of(organ: str, *names: str) -> tuple[Held, ...]:
    """Regions of an organ, at rest."""
    regions = make_shape(organ, {}).regions
    return tuple(Held(name, regions[name]) for name in names)


def moved(way: Vector, *times: float, shares: tuple[float, ...] = (1.0,)) -> Trajectory:
    """From rest along a vector [m]: at each of the `times` [s] a share of it is done."""
    return Trajectory((0.0, *times), ((0.0, 0.0, 0.0), *(scaled(way, share) for share in shares)))
