"""A liver held at its bare area, palpated by a spherical probe low on the front of the right lobe."""

from massspring import Sphere, Trajectory
from studies.geometry import LIVER_REGIONS
from studies.geometry.shape.levelset import PalpationPoint
from studies.scene.placing import along, press_times, scaled
from studies.scene.scene import ForceOutput, Held, Organ, ReferencePlan, Scene
from studies.scene.tissues import LIVER

RADIUS = 0.020  # m, a thumb; twice the edge of the coarsest reference mesh, so that the contact is resolved
DEPTH = 0.010  # m
GAP = 0.0005  # m between probe and surface at the start
PRESS_END = 6.0  # s
DURATION = 8.0  # s
PROBE = PalpationPoint(
    (-0.0451478389765694, -0.058645481466503876, -0.03350042141479926),
    (-0.08765010953605712, -0.9535288492345018, -0.2882710390862113),
)
"""As a number: computed from the surface, its last bits would depend on the processor."""
INWARD = scaled(PROBE.normal, -1.0)

LIVER_PROBE = Scene(
    name="liver_probe",
    title="Liver held at its bare area, a spherical probe of 20 mm radius pushed in by 10 mm",
    organ=Organ("liver"),
    tissue=LIVER,
    duration=DURATION,
    frames=240,
    checkpoints=press_times(0.0, PRESS_END, 5, DURATION),
    obstacles=(
        Sphere(
            along(PROBE.point, PROBE.normal, RADIUS + GAP),
            RADIUS,
            Trajectory((0.0, PRESS_END), ((0.0, 0.0, 0.0), scaled(INWARD, DEPTH + GAP))),
        ),
    ),
    held=(Held("bare_area", LIVER_REGIONS["bare_area"]),),
    probed=ForceOutput("obstacle", 0, INWARD),
    damping=2.0,
    reference=ReferencePlan(),
)
