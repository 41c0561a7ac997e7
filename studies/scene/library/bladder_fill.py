"""A bladder held at its neck and filled by 20 %: the target of its lumen's volume grows, its pressure is the answer."""

from massspring import Ramp
from studies.scene.loads import clamped, held_of
from studies.scene.placing import press_times
from studies.scene.scene import Lumen

FILLING = 1.2  # of the volume at rest; from 1.23 on a wall of one kept volume snaps through at the dome
FILL_END, DURATION = 3.0, 4.0  # s

BLADDER_FILL = clamped(
    "bladder_fill",
    "bladder",
    "Bladder held at its neck, its content grows by 20 %",
    held_of("bladder", "neck"),
    (0.0, 0.0, -1.0),
    seconds=(FILL_END, DURATION),
    frames=200,
    checkpoints=press_times(0.0, FILL_END, 4, DURATION),
    lumen=Lumen(filling=Ramp((0.0, FILL_END), (1.0, FILLING))),
    damping=15.0,
    quantities=("surface", "interior", "silhouette", "volume"),
    not_for=(("free", "without a volume constraint nothing fills the lumen"),),
)
