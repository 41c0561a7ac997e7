"""A ball that is pulled at both caps and incised twice on the way, below and above its middle, one after the other."""

from dataclasses import replace

from studies.geometry import HalfSpace
from studies.scene.cut import Cut
from studies.scene.library.ball_incised import BALL_INCISED, CUT_AT, DURATION, HALF, RADIUS

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
