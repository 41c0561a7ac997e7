"""A ball that is pulled at both caps and cut in two on the way: each half goes back to its shape and volume."""

from dataclasses import replace

from studies.scene.cut import Cut
from studies.scene.library.ball_incised import BALL_INCISED, CUT_AT, MIDDLE

BALL_BISECTED = replace(
    BALL_INCISED,
    name="ball_bisected",
    title="Ball held at both caps, pulled apart by a fifth of the radius, cut in two on the way",
    cuts=(Cut("section", MIDDLE, at=CUT_AT),),
    reference=None,  # the truth is known: halves at rest, each with its volume
    quantities=("volume",),
)
