"""A filled stomach before the back wall, palpated by a spherical probe on its front."""

from massspring import Plane, Sphere, Trajectory
from studies.geometry.organs.stomach import STOMACH_REGIONS
from studies.geometry.shape.levelset import PalpationPoint
from studies.scene.library.stomach_press import BACK
from studies.scene.placing import along, press_times, scaled
from studies.scene.scene import ForceOutput, Held, Lumen, Organ, ReferencePlan, Scene
from studies.scene.tissues import STOMACH

RADIUS = 0.025  # m; twice the edge of the coarsest reference mesh, so that the contact is resolved
DEPTH = 0.012  # m
GAP = 0.0005  # m between probe and surface at the start
PRESS_END = 6.0  # s
DURATION = 8.0  # s
PROBE = PalpationPoint(
    (0.0415, -0.04116513145931427, 0.0),
    (0.16318724755802705, -0.9764054177097882, 0.1414297794009782),
)
"""As a number: computed from the surface, its last bits would depend on the processor."""
INWARD = scaled(PROBE.normal, -1.0)

STOMACH_PROBE = Scene(
    name="stomach_probe",
    title="Filled stomach before the back wall, a spherical probe of 25 mm radius pushed in by 12 mm",
    organ=Organ("stomach"),
    tissue=STOMACH,
    duration=DURATION,
    frames=240,
    checkpoints=press_times(0.0, PRESS_END, 5, DURATION),
    obstacles=(
        Sphere(
            along(PROBE.point, PROBE.normal, RADIUS + GAP),
            RADIUS,
            Trajectory((0.0, PRESS_END), ((0.0, 0.0, 0.0), scaled(INWARD, DEPTH + GAP))),
        ),
        Plane((0.0, BACK, 0.0), (0.0, -1.0, 0.0)),
    ),
    held=tuple(Held(name, STOMACH_REGIONS[name]) for name in ("cardia", "pylorus")),
    lumen=Lumen(),
    probed=ForceOutput("obstacle", 0, INWARD),
    damping=2.0,
    reference=ReferencePlan(base=430),
)
