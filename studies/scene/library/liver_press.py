"""A liver held at its bare area and pressed from the front by a frictionless plane, as by the flat of a hand."""

from massspring import Plane, Trajectory
from studies.geometry import LIVER_PRESS_DIRECTION, LIVER_REGIONS
from studies.scene.placing import press_times, scaled
from studies.scene.scene import ForceOutput, Held, Organ, ReferencePlan, Scene
from studies.scene.tissues import LIVER

FRONT = -0.0686  # m: where the liver begins along the press direction
GAP = 0.0014  # m between plane and liver at the start: curved facets of a coarse mesh bulge that far
DEPTH = 0.020  # m, a sixth of the liver's depth
PRESS_END = 6.0  # s
DURATION = 8.0  # s

LIVER_PRESS = Scene(
    name="liver_press",
    title="Liver held at its bare area, pressed 20 mm by a frictionless plane from the front",
    organ=Organ("liver"),
    tissue=LIVER,
    duration=DURATION,
    frames=240,
    checkpoints=press_times(0.0, PRESS_END, 5, DURATION),
    obstacles=(
        Plane(
            scaled(LIVER_PRESS_DIRECTION, FRONT - GAP),
            LIVER_PRESS_DIRECTION,
            Trajectory((0.0, PRESS_END), ((0.0, 0.0, 0.0), scaled(LIVER_PRESS_DIRECTION, DEPTH + GAP))),
        ),
    ),
    held=(Held("bare_area", LIVER_REGIONS["bare_area"]),),
    probed=ForceOutput("obstacle", 0, LIVER_PRESS_DIRECTION),
    damping=2.0,
    reference=ReferencePlan(at_contact=0),
)
