"""Checks of the times of a scene, and the frames of the events of a cut."""

import math

import numpy as np

from studies.base.errors import StudyError
from studies.scene.cut import Cut
from studies.scene.scene import Scene

MOST_EVENTS = 20
"""Most events of an advancing cut: more take memory and time before the run and do not change the final state."""

MORE, LEAST_MORE = 10, 1000
"""Most frames over those that were asked for, so that frames end at checkpoints; and the least of this number."""
SAME = 1e-9
"""Share of a duration below which two times are the same."""


def check_clock(scene: Scene, file: str = "") -> None:
    """Raises StudyError for an impossible duration, number of frames or checkpoints; file: first words of
    the sentence."""
    if not is_number(scene.duration) or not scene.duration > 0:
        raise StudyError(
            f"{file}scene '{scene.name}': the duration is {scene.duration!r} s; give a finite number above 0"
        )
    if type(scene.frames) is not int or scene.frames < 1:
        raise StudyError(f"{file}scene '{scene.name}': frames is {scene.frames!r}; give a whole number from 1 on")
    times = scene.checkpoints
    if not isinstance(times, tuple | list):
        raise StudyError(f"{file}scene '{scene.name}': checkpoints is {times!r}; give a tuple of times [s]")
    if not all(is_number(t) for t in times) or any(b <= a for a, b in zip((0.0, *times), times, strict=False)):
        raise StudyError(f"{file}scene '{scene.name}': the checkpoints are {times} s; give ascending times above 0")
    if scene.reference is not None and not times:
        raise StudyError(
            f"{file}scene '{scene.name}' has a reference and no checkpoints; give the times [s] at which runs are "
            "compared with it"
        )
    if times and times[-1] > scene.duration * (1 + 1e-9):
        raise StudyError(
            f"{file}scene '{scene.name}': its checkpoints end at {times[-1]} s and the scene at "
            f"{scene.duration:g} s; a run is compared with its reference at times within the scene"
        )


def frames_between(scene: Scene, frames: int) -> int:
    """The least number from `frames` on of equal frames of which one ends at each checkpoint of the scene. Raises
    StudyError where MORE times as many are too few."""
    if not scene.duration > 0:
        return frames  # refused elsewhere
    shares = np.array(scene.checkpoints) / scene.duration
    for count in range(frames, max(MORE * frames, LEAST_MORE) + 1):
        if (np.abs(shares * count - np.round(shares * count)) < SAME * count).all():
            return count
    raise StudyError(
        f"scene '{scene.name}': no number of {frames} to {count} equal frames of {scene.duration:g} s ends at the "
        f"checkpoints {scene.checkpoints} s; round these"
    )


def event_frames(scene: Scene, cut: Cut, frames: int) -> list[int]:
    """Number of frames before each event of the cut: one event, or for an advancing cut up to MOST_EVENTS evenly spaced
    ones.

    Raises StudyError for a cut that begins before the first frame ends, or ends after the last begins or in the frame
    in which it begins, and for a checkpoint after it in its last frame."""
    duration = scene.duration
    first, last = (round(t * frames / duration) for t in (cut.at, cut.ends))
    for frame, t in ((first, cut.at), (last, cut.ends)):
        if not 1 <= frame < frames:
            raise StudyError(
                f"cut '{cut.name}' at {t:g} s is not between two of the {frames} frames of {duration:g} s; "
                "move it, or ask for more frames"
            )
    if cut.until is not None and first == last:
        raise StudyError(
            f"cut '{cut.name}' advances from {cut.at:g} s until {cut.until:g} s, within one of {frames} frames; ask "
            "for more frames, or leave out until and along"
        )
    early = [t for t in scene.checkpoints if t > cut.ends and round(t * frames / duration) <= last]
    if early:
        raise StudyError(
            f"the checkpoint at {early[0]:g} s and cut '{cut.name}' before it at {cut.ends:g} s are in one of {frames} "
            "frames; move one, or ask for more frames"
        )
    return np.linspace(first, last, min(last - first + 1, MOST_EVENTS)).round().astype(int).tolist()


def check_judged_after_cut(scene: Scene) -> None:
    """Raises StudyError for a scene with a reference if a cut has no checkpoint after it, or a checkpoint while it
    advances."""
    if scene.reference is None:
        return
    last = scene.checkpoints[-1]
    for cut in scene.cuts:
        if last <= cut.at:
            raise StudyError(
                f"scene '{scene.name}' has its last checkpoint at {last:g} s and its cut at {cut.at:g} s, so nothing "
                "would judge what is cut; move one of them"
            )
        during = [t for t in scene.checkpoints if cut.at < t <= cut.ends]
        if during:
            raise StudyError(
                f"scene '{scene.name}' has a checkpoint at {during[0]:g} s, and cut '{cut.name}' advances from "
                f"{cut.at:g} to {cut.ends:g} s; the reference knows the body whole and cut, so judge it before or after"
            )


def is_number(value: object) -> bool:
    """Whether it is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
