"""A ball that is pressed together at both caps while it is cut to half its section: the faces of the cut carry it."""

from dataclasses import replace

from massspring import Trajectory
from studies.scene.cut import Cut
from studies.scene.library.ball_incised import BALL_INCISED, CUT_AT, DURATION, HALF, MIDDLE, PULL_END, RADIUS
from studies.scene.placing import press_times
from studies.scene.scene import Held

PUSH = 0.15  # of the radius
TILT = 0.04  # of the radius: the upper cap also slides, so that nothing is symmetric

BALL_CUT_PRESSED = replace(
    BALL_INCISED,
    name="ball_cut_pressed",
    title="Ball held at both caps, pressed together by 15 % of the radius, half of its equator's plane cut on the way",
    held=(
        BALL_INCISED.held[0],
        Held(
            "top",
            BALL_INCISED.held[1].region,
            Trajectory((0.0, PULL_END), ((0.0, 0.0, 0.0), (TILT * RADIUS, 0.0, -PUSH * RADIUS))),
        ),
    ),
    checkpoints=press_times(CUT_AT, PULL_END, 2, DURATION),
    cuts=(Cut("incision", MIDDLE, HALF, at=CUT_AT, contact=True),),
)
