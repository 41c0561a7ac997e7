"""A ball that is cut while it is pulled at both caps: the incision gapes. Also cut twice, cut in two, cut while it is
pressed together, and hollow and opened."""

from dataclasses import replace

from studies.geometry import HalfSpace
from studies.scene.cut import Cut
from studies.scene.library.ball_clamped import RADIUS, caps
from studies.scene.loads import clamped, moved
from studies.scene.placing import press_times
from studies.scene.scene import Lumen, Organ
from studies.scene.tissues import LIVER

PULL = 0.2  # of the radius
REST, CUT_AT, PULL_END, DURATION = 0.7, 1.0, 3.0, 4.0  # s: at REST a third of the pull is done; all is still at the cut
MIDDLE = HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
HALF = HalfSpace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))  # x < 0: the front goes straight through the centre

BALL_INCISED = clamped(
    "ball_incised",
    Organ("ball", {"radius": RADIUS}),
    "Ball held at both caps, pulled apart by a fifth of the radius, half of its equator's plane cut on the way",
    caps(moved((0.0, 0.0, RADIUS), REST, CUT_AT, PULL_END, shares=(1 / 3 * PULL, 1 / 3 * PULL, PULL))),
    (0.0, 0.0, 1.0),
    seconds=(PULL_END, DURATION),
    frames=200,
    tissue=LIVER,
    checkpoints=(CUT_AT, 2.0, DURATION),
    damping=15.0,  # as ball_clamped
    cuts=(Cut("incision", MIDDLE, HALF, at=CUT_AT),),
)

BALL_BISECTED = replace(
    BALL_INCISED,
    name="ball_bisected",
    title="Ball held at both caps, pulled apart by a fifth of the radius, cut in two on the way",
    cuts=(Cut("section", MIDDLE, at=CUT_AT),),
    reference=None,  # the truth is known: halves at rest, each with its volume
    quantities=("volume",),
)

AWAY = 0.25  # of the radius: each plane from the middle
SECOND_AT = 2.0  # s: the pull goes on between the two

BALL_CUT_TWICE = replace(
    BALL_INCISED,
    name="ball_cut_twice",
    title="Ball held at both caps, pulled apart by a fifth of the radius, incised below its middle and then above it",
    checkpoints=(CUT_AT, SECOND_AT, DURATION),
    cuts=tuple(
        Cut(name, HalfSpace((0.0, 0.0, side * AWAY * RADIUS), (0.0, 0.0, 1.0)), HALF, at=at)
        for name, side, at in (("below", -1.0, CUT_AT), ("above", 1.0, SECOND_AT))
    ),
)

PUSH, TILT = 0.15, 0.04  # of the radius: the upper cap also slides, so that nothing is symmetric

BALL_CUT_PRESSED = replace(
    BALL_INCISED,
    name="ball_cut_pressed",
    title="Ball held at both caps, pressed together by 15 % of the radius, half of its equator's plane cut on the way",
    held=caps(moved((TILT * RADIUS, 0.0, -PUSH * RADIUS), PULL_END)),
    checkpoints=press_times(CUT_AT, PULL_END, 2, DURATION),
    cuts=(Cut("incision", MIDDLE, HALF, at=CUT_AT, contact=True),),  # its faces carry the press
)

WALL = 0.008  # m

SHELL_OPENED = replace(
    BALL_INCISED,
    name="shell_opened",
    title="Filled hollow ball held at both caps, pulled apart by a fifth of the radius, half of its equator opened",
    organ=Organ("ball", {"radius": RADIUS, "wall": WALL}),
    lumen=Lumen(),
    cuts=(Cut("opening", MIDDLE, HALF, at=CUT_AT, opens_lumen=True),),  # its content goes
)
