"""The kind of a scene, derived from its contents: a solid or hollow organ, and its kind of load."""

from dataclasses import dataclass

from massspring import Capsule, Plane, Probe, Sphere
from studies.geometry.organs import make_shape
from studies.scene.inertia import top_speed
from studies.scene.scene import Scene

NOT_ADAPTIVE = {
    "motion": "its load has no static solution",
    "thin probe": "the reference elements do not know a thin probe",
    "rest": "nothing loads it",
}
"""Kind of load -> why adaptive bodies, which need a solution with reference elements, are not possible."""


@dataclass(frozen=True)
class Kind:
    """Scenes of one kind make the same demands on a body."""

    hollow: bool
    load: str
    """"press": a plane against a held organ; "probe": a sphere or capsule; "squeeze": between two planes, or two held
    regions; "sag": its weight; "fill": its lumen; "thin probe"; "motion": it starts in motion; "rest": nothing."""

    def __str__(self) -> str:
        """As text: "hollow, press"."""
        return f"{'hollow' if self.hollow else 'solid'}, {self.load}"


def kind_of(scene: Scene) -> Kind:
    """The kind of a scene. Raises StudyError for an unknown organ."""
    return Kind(has_wall(scene), load_of(scene))


def has_wall(scene: Scene) -> bool:
    """Whether the organ of a scene is hollow; for a mesh file, whether it has a wall or a lumen."""
    organ = scene.organ
    if scene.lumen is not None:
        return True
    if organ.shape == "file":
        return "wall" in organ.parameters
    return make_shape(organ.shape, organ.parameters).wall is not None


def load_of(scene: Scene) -> str:
    """The kind of load; if there are several loads, the most local one."""
    if scene.start is not None or (scene.reference is not None and scene.reference.dt is not None):
        return "motion"
    if any(isinstance(obstacle, Probe) for obstacle in scene.obstacles):
        return "thin probe"
    moving = [obstacle for obstacle in scene.obstacles if top_speed(obstacle.path) > 0]
    if any(isinstance(obstacle, Sphere | Capsule) for obstacle in moving):
        return "probe"
    if scene.lumen is not None and scene.lumen.changes:
        return "fill"
    planes = [obstacle for obstacle in moving if isinstance(obstacle, Plane)]
    if any(top_speed(held.path) > 0 for held in scene.held) or len(planes) > 1 or (planes and not scene.held):
        return "squeeze"
    if planes:
        return "press"
    return "sag" if any(scene.gravity) else "rest"
