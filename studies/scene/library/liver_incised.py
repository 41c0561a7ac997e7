"""A liver held at its bare area whose left tip a retractor pulls away while the left lobe is cut from above."""

from massspring import Trajectory
from studies.geometry import LIVER_REGIONS, HalfSpace
from studies.scene.cut import Cut
from studies.scene.scene import ForceOutput, Held, Organ, ReferencePlan, Scene
from studies.scene.tissues import LIVER

TIP = 0.09  # m: the retractor holds what is farther to the left
PULL = 0.020  # m to the left
REST, CUT_AT, PULL_END = 1.4, 2.0, 6.0  # s: a third of the pull is done, the cut is made, the rest is done
DURATION = 8.0  # s
PLANE, FRONT = 0.020, 0.015  # m: the cut lies at this x and goes down to this z

LIVER_INCISED = Scene(
    name="liver_incised",
    title="Liver held at its bare area, its left tip pulled 20 mm to the left, its left lobe cut from above on the way",
    organ=Organ("liver"),
    tissue=LIVER,
    duration=DURATION,
    frames=240,
    checkpoints=(CUT_AT, 4.0, DURATION),
    held=(
        Held("bare_area", LIVER_REGIONS["bare_area"]),
        Held(
            "left_tip",
            HalfSpace((TIP, 0.0, 0.0), (-1.0, 0.0, 0.0)),
            Trajectory(
                (0.0, REST, CUT_AT, PULL_END),
                tuple((share * PULL, 0.0, 0.0) for share in (0.0, 1 / 3, 1 / 3, 1.0)),
            ),
        ),
    ),
    probed=ForceOutput("held", 1, (1.0, 0.0, 0.0)),
    damping=4.0,
    cuts=(
        Cut(
            "incision",
            HalfSpace((PLANE, 0.0, 0.0), (1.0, 0.0, 0.0)),
            HalfSpace((0.0, 0.0, FRONT), (0.0, 0.0, -1.0)),
            at=CUT_AT,
        ),
    ),
    reference=ReferencePlan(),
)
