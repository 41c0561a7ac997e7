"""A ball whose two polar caps are held, the upper one pushed down: no gauge freedom, displacements are comparable."""

from massspring import Trajectory
from studies.geometry import HalfSpace
from studies.scene.loads import clamped, moved
from studies.scene.scene import Held, Organ
from studies.scene.tissues import LIVER

RADIUS = 0.05  # m
CAP = 0.8  # the caps are |z| > CAP · RADIUS
PUSH = 0.25  # of the radius


def caps(path: Trajectory) -> tuple[Held, ...]:
    """Both caps, the upper one on a path."""
    return (
        Held("bottom", HalfSpace((0.0, 0.0, -CAP * RADIUS), (0.0, 0.0, 1.0))),
        Held("top", HalfSpace((0.0, 0.0, CAP * RADIUS), (0.0, 0.0, -1.0)), path),
    )


BALL_CLAMPED = clamped(
    "ball_clamped",
    Organ("ball", {"radius": RADIUS}),
    "Ball held at both caps, the upper one pushed down by a quarter of the radius",
    caps(moved((0.0, 0.0, -PUSH * RADIUS), 3.0)),
    (0.0, 0.0, -1.0),
    seconds=(3.0, 4.0),
    frames=200,
    tissue=LIVER,
    damping=15.0,  # a tenth of critical in the slowest mode: what drags at 5 mm/s stays below 2 % of the force
)
