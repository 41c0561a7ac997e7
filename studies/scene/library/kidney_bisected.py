"""A kidney that is cut in two behind its hilum and pressed together: the section carries the whole press."""

from studies.geometry import HalfSpace
from studies.scene.cut import Cut
from studies.scene.loads import clamped, held_of, moved
from studies.scene.placing import press_times
from studies.scene.scene import Held

SECTION = 0.010  # m from the middle, on the convex side: clear of the hilum, which reaches 0.004 m
MARGIN = 0.023  # m: what is held of the convex side
PUSH = (-0.003, 0.001, 0.0)  # m: towards the hilum, and a little forwards
CUT_AT, PUSH_END, DURATION = 1.0, 3.0, 4.0  # s: cut after a third of the press

KIDNEY_BISECTED = clamped(
    "kidney_bisected",
    "kidney",
    "Kidney held around its hilum, its convex side pushed 3 mm towards it and cut off on the way",
    (
        *held_of("kidney", "hilum"),
        Held("margin", HalfSpace((MARGIN, 0.0, 0.0), (-1.0, 0.0, 0.0)), moved(PUSH, PUSH_END)),
    ),
    (-1.0, 0.0, 0.0),
    seconds=(PUSH_END, DURATION),
    frames=200,
    checkpoints=press_times(CUT_AT, PUSH_END, 2, DURATION),
    damping=15.0,
    cuts=(Cut("section", HalfSpace((SECTION, 0.0, 0.0), (1.0, 0.0, 0.0)), at=CUT_AT, contact=True),),
)
