"""A kidney held around its hilum, palpated by a spherical probe on its front: a concave organ."""

from massspring import Sphere, Trajectory
from studies.geometry.organs.kidney import KIDNEY_REGIONS
from studies.geometry.shape.levelset import PalpationPoint
from studies.scene.placing import along, press_times, scaled
from studies.scene.scene import ForceOutput, Held, Organ, ReferencePlan, Scene
from studies.scene.tissues import KIDNEY

RADIUS = 0.015  # m, a fingertip; twice the edge of the coarsest reference mesh
DEPTH = 0.006  # m, a seventh of the kidney's thickness
GAP = 0.0005  # m between probe and surface at the start
PRESS_END = 3.0  # s: slow enough that damping drags with less than 1 % of the force
DURATION = 4.0  # s
PROBE = PalpationPoint(
    (0.009, -0.021079642908041606, 0.0),
    (0.2041860714122822, -0.9789320958274983, 0.0),
)
"""As a number: computed from the surface, its last bits would depend on the processor."""
INWARD = scaled(PROBE.normal, -1.0)

KIDNEY_PROBE = Scene(
    name="kidney_probe",
    title="Kidney held around its hilum, a spherical probe of 15 mm radius pushed in by 6 mm",
    organ=Organ("kidney"),
    tissue=KIDNEY,
    duration=DURATION,
    frames=200,
    checkpoints=press_times(0.0, PRESS_END, 5, DURATION),
    obstacles=(
        Sphere(
            along(PROBE.point, PROBE.normal, RADIUS + GAP),
            RADIUS,
            Trajectory((0.0, PRESS_END), ((0.0, 0.0, 0.0), scaled(INWARD, DEPTH + GAP))),
        ),
    ),
    held=(Held("hilum", KIDNEY_REGIONS["hilum"]),),
    probed=ForceOutput("obstacle", 0, INWARD),
    damping=15.0,
    reference=ReferencePlan(),
)
