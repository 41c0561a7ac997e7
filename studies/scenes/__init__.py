"""The scenes, one file each. Adding one: a file and a line in SCENES, where tests, commands and charts find it."""

from studies.scene.scene import Held, Lumen, Organ, Probed, ReferencePlan, Scene
from studies.scene.start import Start
from studies.scene.tissues import Tissue
from studies.scenes.ball_clamped import BALL_CLAMPED
from studies.scenes.ball_ringing import BALL_RINGING
from studies.scenes.ball_squeeze import BALL_SQUEEZE
from studies.scenes.bladder_fill import BLADDER_FILL
from studies.scenes.kidney_probe import KIDNEY_PROBE
from studies.scenes.liver_press import LIVER_PRESS
from studies.scenes.liver_probe import LIVER_PROBE
from studies.scenes.spleen_sag import SPLEEN_SAG
from studies.scenes.stomach_press import STOMACH_PRESS
from studies.scenes.stomach_probe import STOMACH_PROBE
from studies.scenes.stomach_slide import STOMACH_SLIDE

SCENES: tuple[Scene, ...] = (
    BALL_SQUEEZE,
    BALL_CLAMPED,
    BALL_RINGING,
    LIVER_PRESS,
    LIVER_PROBE,
    KIDNEY_PROBE,
    SPLEEN_SAG,
    STOMACH_PRESS,
    STOMACH_PROBE,
    BLADDER_FILL,
)

UNJUDGED: tuple[Scene, ...] = (STOMACH_SLIDE,)
"""Scenes of the mass-spring body alone: found by commands, without a reference, so in no study of accuracy."""

__all__ = [
    "BALL_CLAMPED",
    "BALL_RINGING",
    "BALL_SQUEEZE",
    "BLADDER_FILL",
    "KIDNEY_PROBE",
    "LIVER_PRESS",
    "LIVER_PROBE",
    "SCENES",
    "SPLEEN_SAG",
    "STOMACH_PRESS",
    "STOMACH_PROBE",
    "STOMACH_SLIDE",
    "UNJUDGED",
    "Held",
    "Lumen",
    "Organ",
    "Probed",
    "ReferencePlan",
    "Scene",
    "Start",
    "Tissue",
]
