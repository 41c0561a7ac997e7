"""A ball that is pulled at both caps while it is cut to half its section: the incision gapes."""

from massspring import Trajectory
from studies.geometry import HalfSpace
from studies.scene.cut import Cut
from studies.scene.scene import ForceOutput, Held, Organ, ReferencePlan, Scene
from studies.scene.tissues import LIVER

RADIUS = 0.05  # m
CAP = 0.8  # the caps are |z| > CAP · RADIUS
PULL = 0.2  # of the radius
REST = 0.7  # s: a third of the pull is done; all is still when the cut comes
CUT_AT = 1.0  # s
PULL_END = 3.0  # s
DURATION = 4.0  # s
MIDDLE = HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
HALF = HalfSpace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))  # x < 0: the front goes straight through the centre

BALL_INCISED = Scene(
    name="ball_incised",
    title="Ball held at both caps, pulled apart by a fifth of the radius, half of its equator's plane cut on the way",
    organ=Organ("ball", {"radius": RADIUS}),
    tissue=LIVER,
    duration=DURATION,
    frames=200,
    checkpoints=(CUT_AT, 2.0, DURATION),
    held=(
        Held("bottom", HalfSpace((0.0, 0.0, -CAP * RADIUS), (0.0, 0.0, 1.0))),
        Held(
            "top",
            HalfSpace((0.0, 0.0, CAP * RADIUS), (0.0, 0.0, -1.0)),
            Trajectory(
                (0.0, REST, CUT_AT, PULL_END),
                tuple((0.0, 0.0, share * PULL * RADIUS) for share in (0.0, 1 / 3, 1 / 3, 1.0)),
            ),
        ),
    ),
    probed=ForceOutput("held", 1, (0.0, 0.0, 1.0)),
    damping=15.0,  # as ball_clamped
    cuts=(Cut("incision", MIDDLE, HALF, at=CUT_AT),),
    reference=ReferencePlan(),
)
