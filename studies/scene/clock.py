"""What the times of a scene may be."""

import math

from studies.base.errors import StudyError
from studies.scene.cut import Cut
from studies.scene.scene import Scene


def check_clock(scene: Scene, file: str = "") -> None:
    """Raises StudyError for a duration, a number of frames or checkpoints that no run could have; file: first words of
    the sentence."""
    if not is_number(scene.duration) or not scene.duration > 0:
        raise StudyError(
            f"{file}scene '{scene.name}': the duration is {scene.duration!r} s; give a finite number above 0"
        )
    if type(scene.frames) is not int or scene.frames < 1:
        raise StudyError(f"{file}scene '{scene.name}': frames is {scene.frames!r}; give a whole number from 1 on")
    times = scene.checkpoints
    if not all(is_number(t) for t in times) or any(b <= a for a, b in zip((0.0, *times), times, strict=False)):
        raise StudyError(f"{file}scene '{scene.name}': the checkpoints are {times} s; give ascending times above 0")
    if scene.reference is not None and (not times or times[-1] > scene.duration * (1 + 1e-9)):
        raise StudyError(
            f"{file}scene '{scene.name}': its checkpoints end at {times[-1] if times else None} s and the scene at "
            f"{scene.duration:g} s; a run is compared with its reference at times within the scene"
        )


def event_frame(scene: Scene, cut: Cut, frames: int) -> int:
    """Frames before the cut. Raises StudyError for one before the first frame ends, or after the last begins, and for a
    checkpoint after it in its frame."""
    duration = scene.duration
    frame = round(cut.at * frames / duration)
    if not 1 <= frame < frames:
        raise StudyError(
            f"cut '{cut.name}' at {cut.at:g} s is not between two of the {frames} frames of {duration:g} s; "
            "move it, or ask for more frames"
        )
    early = [t for t in scene.checkpoints if t > cut.at and round(t * frames / duration) <= frame]
    if early:
        raise StudyError(
            f"the checkpoint at {early[0]:g} s and cut '{cut.name}' before it at {cut.at:g} s are in one of {frames} "
            "frames; move one, or ask for more frames"
        )
    return frame


def check_judged_after_cut(scene: Scene) -> None:
    """Raises StudyError where all checkpoints of a reference come before the cut of its scene."""
    cut, last = scene.cut, scene.checkpoints[-1]
    if cut is not None and scene.reference is not None and last <= cut.at:
        raise StudyError(
            f"scene '{scene.name}' has its last checkpoint at {last:g} s and its cut at {cut.at:g} s, so nothing "
            "would judge what is cut; move one of them"
        )


def is_number(value: object) -> bool:
    """Whether it is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
