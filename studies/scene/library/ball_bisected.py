"""A ball that is pulled at both caps and cut in two on the way: each half goes back to its shape and volume."""

from massspring import Trajectory
from studies.geometry import HalfSpace
from studies.scene.cut import Cut
from studies.scene.placing import press_times
from studies.scene.scene import ForceOutput, Held, Organ, Scene
from studies.scene.tissues import LIVER

RADIUS = 0.05  # m
CAP = 0.8  # the caps are |z| > CAP · RADIUS
PULL = 0.2  # of the radius
CUT_AT = 1.0  # s: a third of the pull
PULL_END = 3.0  # s
DURATION = 4.0  # s
MIDDLE = HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))

BALL_BISECTED = Scene(
    name="ball_bisected",
    title="Ball held at both caps, pulled apart by a fifth of the radius, cut in two on the way",
    organ=Organ("ball", {"radius": RADIUS}),
    tissue=LIVER,
    duration=DURATION,
    frames=200,
    checkpoints=press_times(CUT_AT, PULL_END, 4, DURATION),
    held=(
        Held("bottom", HalfSpace((0.0, 0.0, -CAP * RADIUS), (0.0, 0.0, 1.0))),
        Held(
            "top",
            HalfSpace((0.0, 0.0, CAP * RADIUS), (0.0, 0.0, -1.0)),
            Trajectory((0.0, PULL_END), ((0.0, 0.0, 0.0), (0.0, 0.0, PULL * RADIUS))),
        ),
    ),
    probed=ForceOutput("held", 1, (0.0, 0.0, 1.0)),
    damping=15.0,  # as ball_clamped
    cuts=(Cut("section", MIDDLE, at=CUT_AT),),
    reference=None,  # the truth is known: halves at rest, each with its volume
    quantities=("volume",),
)
