"""The scenes, one file each. Adding one: a file and a line in SCENES, from which all else follows."""

from studies.scene.scene import ForceOutput, Held, Lumen, Organ, ReferencePlan, Scene
from studies.scene.start import InitialConditions
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
    STOMACH_SLIDE,
)

JUDGED: tuple[Scene, ...] = tuple(scene for scene in SCENES if scene.reference is not None)
"""Scenes with a reference: a study may ask how accurate a run of theirs is."""

__all__ = [
    "BALL_CLAMPED",
    "BALL_RINGING",
    "BALL_SQUEEZE",
    "BLADDER_FILL",
    "JUDGED",
    "KIDNEY_PROBE",
    "LIVER_PRESS",
    "LIVER_PROBE",
    "SCENES",
    "SPLEEN_SAG",
    "STOMACH_PRESS",
    "STOMACH_PROBE",
    "STOMACH_SLIDE",
    "ForceOutput",
    "Held",
    "InitialConditions",
    "Lumen",
    "Organ",
    "ReferencePlan",
    "Scene",
    "Tissue",
]
