"""A kidney that is cut in two behind its hilum and pressed together: the section carries the whole press."""

from massspring import Trajectory
from studies.geometry import HalfSpace
from studies.geometry.organs.kidney import KIDNEY_REGIONS
from studies.scene.cut import Cut
from studies.scene.placing import press_times
from studies.scene.scene import ForceOutput, Held, Organ, ReferencePlan, Scene
from studies.scene.tissues import KIDNEY

SECTION = 0.010  # m from the middle, on the convex side: clear of the hilum, which reaches 0.004 m
MARGIN = 0.023  # m: what is held of the convex side
PUSH = (-0.003, 0.001, 0.0)  # m: towards the hilum, and a little forwards
CUT_AT = 1.0  # s: a third of the press
PUSH_END = 3.0  # s
DURATION = 4.0  # s

KIDNEY_BISECTED = Scene(
    name="kidney_bisected",
    title="Kidney held around its hilum, its convex side pushed 3 mm towards it and cut off on the way",
    organ=Organ("kidney"),
    tissue=KIDNEY,
    duration=DURATION,
    frames=200,
    checkpoints=press_times(CUT_AT, PUSH_END, 2, DURATION),
    held=(
        Held("hilum", KIDNEY_REGIONS["hilum"]),
        Held(
            "margin",
            HalfSpace((MARGIN, 0.0, 0.0), (-1.0, 0.0, 0.0)),
            Trajectory((0.0, PUSH_END), ((0.0, 0.0, 0.0), PUSH)),
        ),
    ),
    probed=ForceOutput("held", 1, (-1.0, 0.0, 0.0)),
    damping=15.0,
    cuts=(Cut("section", HalfSpace((SECTION, 0.0, 0.0), (1.0, 0.0, 0.0)), at=CUT_AT, contact=True),),
    reference=ReferencePlan(),
)
