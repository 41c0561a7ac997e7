"""An octant of the squeezed ball on three very coarse meshes; its reference takes seconds."""

from dataclasses import replace

from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.scene.scene import ReferencePlan

LEVELS = (0.5, 0.4, 0.32)
SCENE = replace(BALL_SQUEEZE, reference=ReferencePlan("octant", LEVELS), checkpoints=(1.0, 4.0))
