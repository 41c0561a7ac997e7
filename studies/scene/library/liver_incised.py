"""A liver held at its bare area whose left tip a retractor pulls away while the left lobe is cut from above: at once,
or live, downwards for a second."""

from dataclasses import replace

from studies.geometry import HalfSpace
from studies.scene.cut import Cut
from studies.scene.loads import clamped, held_of, moved
from studies.scene.scene import Held

TIP = 0.09  # m: the retractor holds what is farther to the left
PULL = 0.020  # m to the left
REST, CUT_AT, PULL_END = 1.4, 2.0, 6.0  # s: a third of the pull is done, the cut is made, the rest is done
CUT_END = 3.0  # s, of the cut that is live
DURATION = 8.0  # s
PLANE, FRONT = 0.020, 0.015  # m: the cut lies at this x and goes down to this z
RETRACTOR = moved((PULL, 0.0, 0.0), REST, CUT_AT, PULL_END, shares=(1 / 3, 1 / 3, 1.0))
INCISION = Cut(
    "incision",
    HalfSpace((PLANE, 0.0, 0.0), (1.0, 0.0, 0.0)),
    HalfSpace((0.0, 0.0, FRONT), (0.0, 0.0, -1.0)),
    at=CUT_AT,
)

LIVER_INCISED = clamped(
    "liver_incised",
    "liver",
    "Liver held at its bare area, its left tip pulled 20 mm to the left, its left lobe cut from above on the way",
    (*held_of("liver", "bare_area"), Held("left_tip", HalfSpace((TIP, 0.0, 0.0), (-1.0, 0.0, 0.0)), RETRACTOR)),
    (1.0, 0.0, 0.0),
    seconds=(PULL_END, DURATION),
    frames=240,
    checkpoints=(CUT_AT, 4.0, DURATION),
    damping=4.0,
    cuts=(INCISION,),
)

LIVER_CUT_LIVE = replace(
    LIVER_INCISED,
    name="liver_cut_live",
    title="Liver held at its bare area, its left tip pulled 20 mm to the left, its left lobe cut downwards for 1 s",
    cuts=(replace(INCISION, until=CUT_END, along=(0.0, 0.0, -1.0)),),
)
