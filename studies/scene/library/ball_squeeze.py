"""The paper's Figure 2: a ball squeezed by 30 % of its diameter between two frictionless planes, 800 frames."""

from massspring import Plane, Trajectory
from studies.scene.placing import press_times
from studies.scene.scene import ForceOutput, Organ, ReferencePlan, Scene
from studies.scene.tissues import LIVER

RADIUS = 0.05  # m
DEPTH = 0.30  # of the diameter; each plane does half of it
PRESS_END = (
    3.0  # s: 5 mm/s a plane, a twentieth of the speed of a shear wave across the ball in its slowest ringing period
)
DURATION = 4.0  # s

BALL_SQUEEZE = Scene(
    name="ball_squeeze",
    title="Ball squeezed by 30 % of its diameter between two frictionless planes",
    organ=Organ("ball", {"radius": RADIUS}),
    tissue=LIVER,
    duration=DURATION,
    frames=800,
    checkpoints=press_times(0.0, PRESS_END, 6, DURATION),
    obstacles=(
        Plane((0.0, 0.0, RADIUS), (0.0, 0.0, -1.0), Trajectory((0.0, PRESS_END), ((0, 0, 0), (0, 0, -DEPTH * RADIUS)))),
        Plane((0.0, 0.0, -RADIUS), (0.0, 0.0, 1.0), Trajectory((0.0, PRESS_END), ((0, 0, 0), (0, 0, DEPTH * RADIUS)))),
    ),
    probed=ForceOutput("obstacle", 0, (0.0, 0.0, -1.0)),
    damping=15.0,  # a tenth of critical in the slowest mode: what drags at 5 mm/s stays below 2 % of the force
    reference=ReferencePlan("octant", (0.22, 0.16, 0.12)),
    # The ball may turn about any axis at no energy: displacements of material points are not comparable.
    quantities=("force", "silhouette", "volume"),
)
