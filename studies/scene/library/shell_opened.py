"""A hollow ball with a closed content, pulled at both caps and opened along half of its equator: the content goes."""

from dataclasses import replace

from studies.scene.cut import Cut
from studies.scene.library.ball_incised import BALL_INCISED, CUT_AT, HALF, MIDDLE, RADIUS
from studies.scene.scene import Lumen, Organ

WALL = 0.008  # m

SHELL_OPENED = replace(
    BALL_INCISED,
    name="shell_opened",
    title="Filled hollow ball held at both caps, pulled apart by a fifth of the radius, half of its equator opened",
    organ=Organ("ball", {"radius": RADIUS, "wall": WALL}),
    lumen=Lumen(),
    cuts=(Cut("opening", MIDDLE, HALF, at=CUT_AT, opens_lumen=True),),
)
