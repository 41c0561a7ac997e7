"""A bladder held at its neck and filled by 20 %: the target of its lumen's volume grows, its pressure is the answer."""

from massspring import Ramp
from studies.geometry.organs.bladder import BLADDER_REGIONS
from studies.scene.placing import press_times
from studies.scene.scene import ForceOutput, Held, Lumen, Organ, ReferencePlan, Scene
from studies.scene.tissues import BLADDER

FILLING = 1.2  # of the volume at rest; from 1.23 on a wall of one kept volume snaps through at the dome
FILL_END = 3.0  # s
DURATION = 4.0  # s

BLADDER_FILL = Scene(
    name="bladder_fill",
    title="Bladder held at its neck, its content grows by 20 %",
    organ=Organ("bladder"),
    tissue=BLADDER,
    duration=DURATION,
    frames=200,
    checkpoints=press_times(0.0, FILL_END, 4, DURATION),
    held=(Held("neck", BLADDER_REGIONS["neck"]),),
    lumen=Lumen(filling=Ramp((0.0, FILL_END), (1.0, FILLING))),
    probed=ForceOutput("held", 0, (0.0, 0.0, -1.0)),
    damping=15.0,
    reference=ReferencePlan(),
    quantities=("surface", "interior", "silhouette", "volume"),
    not_for=(("free", "without a volume constraint nothing fills the lumen"),),
)
