"""The scenes, one file each. Adding one: a file and a line in SCENES, where tests, commands and charts find it."""

from studies.scenes.ball_clamped import BALL_CLAMPED
from studies.scenes.ball_squeeze import BALL_SQUEEZE
from studies.scenes.base import Held, Organ, Probed, ReferencePlan, Scene, Tissue
from studies.scenes.liver_press import LIVER_PRESS
from studies.scenes.liver_probe import LIVER_PROBE

SCENES: tuple[Scene, ...] = (BALL_SQUEEZE, BALL_CLAMPED, LIVER_PRESS, LIVER_PROBE)

__all__ = ["SCENES", "Held", "Organ", "Probed", "ReferencePlan", "Scene", "Tissue"]
