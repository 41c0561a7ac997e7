"""The paper's scenes (Jung, Hong, Choi 2005) on the paper's surface bodies, for Figures 2 to 4 and docs/paper.md."""

from dataclasses import dataclass

import numpy as np

from massspring import Free, History, ImplicitVolume, Method, Probe, simulate
from studies.base.errors import StudyError
from studies.runs.case import Case
from studies.runs.prepare import Prepared, prepare
from studies.runs.recipes import SurfaceBody
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.scene.library.stomach_slide import NODES, PRESS_END, SLIDE_END, STOMACH_SLIDE

BALL_NODES = 550


@dataclass(frozen=True, eq=False)
class Played:
    """A case, set up and run, with the positions after every frame."""

    case: Case
    prepared: Prepared
    history: History

    @property
    def force(self) -> np.ndarray:
        """The probed force of every frame [N], (F,)."""
        return self.case.scene.output_force(self.history.contact_force, self.history.held_force)


def play(case: Case) -> Played:
    """Runs a case to its end. Raises StudyError when it breaks off."""
    prepared = prepare(case)
    history = simulate(prepared.setup, range(1, prepared.setup.clock.frames + 1))
    if history.outcome != "finished":
        raise StudyError(f"{case.name}: {history.message}; the paper's figures need all frames")
    return Played(case, prepared, history)


def ball_case(method: Method, nodes: int = BALL_NODES) -> Case:
    """The squeezed ball of Figures 2 and 3 on the paper's surface body; 800 frames, the iterations of the paper."""
    return Case(BALL_SQUEEZE, SurfaceBody(nodes), method)


def slide_case(nodes: int = NODES, method: Method | None = None) -> Case:
    """The refined stomach and the sliding probe of Figure 4; a few hundred nodes are enough for a test."""
    return Case(STOMACH_SLIDE, SurfaceBody(nodes, axis="centre_line"), method or ImplicitVolume())


def squeezed_balls(nodes: int = BALL_NODES) -> dict[str, Played]:
    """The squeezed ball without and with the constraint, both played."""
    return {method.name: play(ball_case(method, nodes)) for method in (Free(), ImplicitVolume())}


def moments(slide: Played) -> dict[str, int]:
    """Frames (0, 1, …) of the first contact, the deepest point and the end of the slide. Raises StudyError."""
    touched = np.flatnonzero(slide.force > 0)
    if not len(touched):
        raise StudyError(f"{slide.case.name}: the probe never touches the organ; start it nearer")
    t = slide.history.t
    at = {"deep": PRESS_END, "end of the slide": SLIDE_END}
    return {"first contact": int(touched[0])} | {name: int(np.argmin(np.abs(t - time))) for name, time in at.items()}


def tip_of(slide: Played, frame: int) -> np.ndarray:
    """Position of the probe's tip at the end of frame number `frame` (0, 1, …) [m], (3,)."""
    probe = slide.case.scene.obstacles[0]
    assert isinstance(probe, Probe)
    return probe.anchor + probe.path(float(slide.history.t[frame]))
