"""How a trial of the reference ends: ok, or a failure with a name; everything else is unexplained."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from reference_fem import Checkpoint, Equilibrium, SolveError, equilibrium_path
from reference_fem.dynamics.inertia import MovingSystem
from reference_fem.dynamics.motion_path import check_element, motion_path
from reference_fem.system.saddle_point import System
from reference_fem.system.state import State
from studies.base.errors import StudyError
from studies.tools.fuzz.outcome import UNEXPLAINED, Outcome, end_of
from studies.tools.fuzz.reference.surroundings import Task, task_of
from studies.tools.fuzz.reference.trial import ReferenceTrial
from studies.tools.fuzz.reference.truths import broken, corner_ratio

SECONDS = 10.0
"""Processor time after which a trial is given up, asked in each load step."""


class TimedOut(Exception):
    """A trial that took longer than it may."""


@dataclass
class Reached:
    """The last state that converged, as far as a trial has come."""

    equilibrium: Equilibrium | None = None
    state: State | None = None
    """Its unknowns; None in a motion."""
    count: int = 0

    def step(self, moment: Equilibrium) -> None:
        """Hears of a moment of a motion."""
        self.equilibrium, self.count = moment, self.count + 1

    def checkpoint(self, point: Checkpoint) -> None:
        """Hears of a state of rest."""
        self.equilibrium, self.state, self.count = point.path[-1], point.state, len(point.path)


@dataclass(frozen=True)
class ReferenceOutcome(Outcome):
    """Of a trial of the reference."""

    reached: Reached = field(default_factory=Reached)

    @property
    def row(self) -> dict[str, object]:
        """For a table."""
        return {**super().row, "reached": self.reached.count}


def tried(trial: ReferenceTrial, seconds: float = SECONDS) -> ReferenceOutcome:
    """What comes of a trial. Never raises: an error that is not ours is the finding."""
    begun, reached = time.process_time(), Reached()
    status, message = end_of(lambda: _run(trial, _clock(begun + seconds), reached))
    return ReferenceOutcome(trial, status, message, time.process_time() - begun, reached)


def _clock(end: float) -> Callable[[], None]:
    def ask() -> None:
        if time.process_time() > end:
            raise TimedOut

    return ask


def _run(trial: ReferenceTrial, ask: Callable[[], None], reached: Reached) -> tuple[str, str]:
    """Sets up, solves, and measures the last state that converged, whatever came after it."""
    try:
        task = task_of(trial, ask)
        system = _system(task)
    except (SolveError, StudyError) as refused:
        return "refused", str(refused)
    status, message = "ok", ""
    try:
        _solve(task, reached)
    except SolveError as stuck:
        status, message = "not-converged", str(stuck)
        if len(stuck.converged) != reached.count:
            return UNEXPLAINED, f"the error reports {len(stuck.converged)} states of {reached.count}: {stuck}"
    except TimedOut:
        status, message = "timed-out", f"{reached.count} of {trial.steps} requested times reached"
    if reached.equilibrium is None:
        return status, message
    wrong = broken(system, reached.equilibrium, reached.state)
    if wrong:
        return UNEXPLAINED, wrong
    least, flattest = corner_ratio(system, reached.equilibrium.u)
    if status == "ok" and flattest <= 0.0:
        return "inverted", f"an element is inverted at a corner at rest (volume ratio {flattest:.3g})"
    if status == "ok" and least <= 0.0:
        return "inverted", f"an element is inverted at a corner (smallest volume ratio {least:.3g})"
    return status, message


def _system(task: Task) -> System:
    """What is checked before anything is solved. Raises SolveError."""
    if task.dynamics is None:
        return System(task.problem, task.newton)
    check_element(task.problem)
    return MovingSystem(task.problem, task.newton, task.dynamics.damping)


def _solve(task: Task, reached: Reached) -> None:
    if task.dynamics is None:
        equilibrium_path(task.problem, task.times, task.newton, on_checkpoint=reached.checkpoint)
    else:
        motion_path(task.problem, task.times, task.dynamics, on_step=reached.step)
