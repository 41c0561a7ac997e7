"""A filled stomach between the back wall and a plane that presses from the front: wall and content are two volumes."""

from massspring import Plane, Trajectory
from studies.geometry.organs.stomach import STOMACH_REGIONS
from studies.scene.placing import press_times
from studies.scene.scene import ForceOutput, Held, Lumen, Organ, ReferencePlan, Scene
from studies.scene.tissues import STOMACH

FRONT, BACK = -0.0487, 0.0630  # m: the stomach reaches from FRONT to 0.0621, and a coarse curved mesh a little farther
GAP = 0.0008  # m between plane and stomach at the start
DEPTH = 0.020  # m, a sixth of the stomach's depth
PRESS_END = 6.0  # s
DURATION = 8.0  # s
INWARD = (0.0, 1.0, 0.0)

STOMACH_PRESS = Scene(
    name="stomach_press",
    title="Filled stomach held at cardia and pylorus, pressed 20 mm against the back wall by a frictionless plane",
    organ=Organ("stomach"),
    tissue=STOMACH,
    duration=DURATION,
    frames=240,
    checkpoints=press_times(0.0, PRESS_END, 5, DURATION),
    obstacles=(
        Plane(
            (0.0, FRONT - GAP, 0.0), INWARD, Trajectory((0.0, PRESS_END), ((0.0, 0.0, 0.0), (0.0, DEPTH + GAP, 0.0)))
        ),
        Plane((0.0, BACK, 0.0), (0.0, -1.0, 0.0)),
    ),
    held=tuple(Held(name, STOMACH_REGIONS[name]) for name in ("cardia", "pylorus")),
    lumen=Lumen(),
    probed=ForceOutput("obstacle", 0, INWARD),
    damping=2.0,
    reference=ReferencePlan(base=430, at_contact=0),
)
