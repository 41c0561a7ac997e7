"""A filled stomach held at its ends whose front is opened on the way: the content goes, a retractor holds it open."""

from massspring import Ramp
from studies.geometry import HalfSpace
from studies.scene.cut import Cut
from studies.scene.loads import clamped, held_of, moved
from studies.scene.scene import Held, Lumen, ReferencePlan

SIDE = 0.070  # m: the retractor holds what is farther to the left, on the greater curvature
PULL = 0.010  # m to the left
FILLING = 1.05  # of the volume at rest
REST, CUT_AT = 1.4, 2.0  # s: it is filled and a third of the pull is done; the cut is made
PULL_ON, PULL_END = 4.0, 6.5  # s: opened, it has come to rest; the rest of the pull is done
DURATION = 8.5  # s
PLANE = 0.040  # m: the cut lies at this x, clear of cardia, pylorus and retractor
BOTTOM, TOP = (-0.009, -0.092), (0.018, 0.098)  # m: y and z of the lowest and highest places of that section
RETRACTOR = moved((PULL, 0.0, 0.0), REST, PULL_ON, PULL_END, shares=(1 / 3, 1 / 3, 1.0))

STOMACH_OPENED = clamped(
    "stomach_opened",
    "stomach",
    "Filled stomach held at cardia and pylorus, its greater curvature pulled 10 mm, its front opened on the way",
    (
        *held_of("stomach", "cardia", "pylorus"),
        Held("greater_curvature", HalfSpace((SIDE, 0.0, 0.0), (-1.0, 0.0, 0.0)), RETRACTOR),
    ),
    (1.0, 0.0, 0.0),
    seconds=(PULL_END, DURATION),
    frames=255,
    checkpoints=(CUT_AT, PULL_ON, DURATION),
    lumen=Lumen(filling=Ramp((0.0, REST), (1.0, FILLING))),
    damping=4.0,
    cuts=(
        Cut(
            "gastrotomy",
            HalfSpace((PLANE, 0.0, 0.0), (1.0, 0.0, 0.0)),
            HalfSpace((PLANE, *BOTTOM), (0.0, TOP[1] - BOTTOM[1], BOTTOM[0] - TOP[0])),
            at=CUT_AT,
            opens_lumen=True,
        ),
    ),
    reference=ReferencePlan(base=430, most=120e3),
)
