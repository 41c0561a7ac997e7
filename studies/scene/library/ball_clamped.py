"""A ball whose two polar caps are held, the upper one pushed down: no gauge freedom, displacements are comparable."""

from massspring import Trajectory
from studies.geometry import HalfSpace
from studies.scene.placing import press_times
from studies.scene.scene import ForceOutput, Held, Organ, ReferencePlan, Scene
from studies.scene.tissues import LIVER

RADIUS = 0.05  # m
CAP = 0.8  # the caps are |z| > CAP · RADIUS
PUSH = 0.25  # of the radius
PRESS_END = 3.0  # s
DURATION = 4.0  # s

BALL_CLAMPED = Scene(
    name="ball_clamped",
    title="Ball held at both caps, the upper one pushed down by a quarter of the radius",
    organ=Organ("ball", {"radius": RADIUS}),
    tissue=LIVER,
    duration=DURATION,
    frames=200,
    checkpoints=press_times(0.0, PRESS_END, 5, DURATION),
    held=(
        Held("bottom", HalfSpace((0.0, 0.0, -CAP * RADIUS), (0.0, 0.0, 1.0))),
        Held(
            "top",
            HalfSpace((0.0, 0.0, CAP * RADIUS), (0.0, 0.0, -1.0)),
            Trajectory((0.0, PRESS_END), ((0.0, 0.0, 0.0), (0.0, 0.0, -PUSH * RADIUS))),
        ),
    ),
    probed=ForceOutput("held", 1, (0.0, 0.0, -1.0)),
    damping=15.0,  # a tenth of critical in the slowest mode: what drags at 5 mm/s stays below 2 % of the force
    reference=ReferencePlan(),
)
