"""The scenes. Adding one: a file and a line in SCENES, from which all else follows."""

from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.library.ball_cuts import BALL_BISECTED, BALL_CUT_PRESSED, BALL_CUT_TWICE, BALL_INCISED, SHELL_OPENED
from studies.scene.library.ball_ringing import BALL_RINGING
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.scene.library.bladder_fill import BLADDER_FILL
from studies.scene.library.kidney_bisected import KIDNEY_BISECTED
from studies.scene.library.kidney_probe import KIDNEY_PROBE
from studies.scene.library.liver_incised import LIVER_CUT_LIVE, LIVER_INCISED
from studies.scene.library.liver_press import LIVER_PRESS
from studies.scene.library.liver_probe import LIVER_PROBE
from studies.scene.library.spleen_sag import SPLEEN_SAG
from studies.scene.library.stomach_opened import STOMACH_OPENED
from studies.scene.library.stomach_press import STOMACH_PRESS, STOMACH_PROBE
from studies.scene.library.stomach_slide import STOMACH_SLIDE
from studies.scene.scene import Scene

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
"""Scenes with a reference, in which studies can measure accuracy."""

CUT: tuple[Scene, ...] = (
    BALL_INCISED,
    BALL_CUT_TWICE,
    LIVER_INCISED,
    LIVER_CUT_LIVE,
    BALL_BISECTED,
    BALL_CUT_PRESSED,
    KIDNEY_BISECTED,
    SHELL_OPENED,
    STOMACH_OPENED,
)
"""Scenes that cut their organ. They are not in SCENES, since surface bodies cannot run scenes with a front inside the
organ, and half of the methods support no cuts."""
