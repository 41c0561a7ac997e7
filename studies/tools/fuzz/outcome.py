"""How a trial ends: ok, or a failure with a name; everything else is unexplained."""

import time
import warnings
from collections import deque
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from massspring import MassSpringError, simulate
from studies.base.errors import StudyError
from studies.tools.fuzz.choices import Choices
from studies.tools.fuzz.surroundings import setup_of
from studies.tools.fuzz.trial import Trial
from studies.tools.fuzz.truths import broken, named

UNEXPLAINED = "unexplained"
SECONDS = 20.0
"""After which a trial is given up."""


@dataclass(frozen=True)
class Outcome:
    """Of a trial."""

    trial: Choices
    status: str
    """ "ok", "refused", "diverged", "blocked", "inverted", "drifted", "penetrated", "timed-out", or UNEXPLAINED; of the
    reference "not-converged" too."""
    message: str
    seconds: float

    @property
    def row(self) -> dict[str, object]:
        """For a table."""
        return {**asdict(self.trial), "status": self.status, "message": self.message, "seconds": self.seconds}


Attempt = Callable[[Any], Outcome]
"""What comes of a trial."""


def tried(trial: Trial) -> Outcome:
    """What comes of a trial. Never raises: an error that is not ours is the finding."""
    begun = time.perf_counter()
    return Outcome(trial, *end_of(lambda: _run(trial), MassSpringError, StudyError), time.perf_counter() - begun)


def end_of(run: Callable[[], tuple[str, str]], *refusals: type[Exception]) -> tuple[str, str]:
    """Status and message of a run; an error that is none of `refusals` is UNEXPLAINED."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return run()
        except refusals as refused:
            return "refused", str(refused)
        except Exception as error:  # whatever it is, it has no name
            return UNEXPLAINED, f"{type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}"


def _run(trial: Trial) -> tuple[str, str]:
    setup = setup_of(trial)
    history = simulate(setup, time_limit=SECONDS)
    if history.outcome != "finished":
        return history.outcome, history.message
    wrong = broken(setup, history)
    return (UNEXPLAINED, wrong) if wrong else named(setup, history)


def simplest(outcome: Outcome, most: int = 200, attempt: Attempt = tried) -> Outcome:
    """A trial with as few choices off the gentlest as still ends in that status, tried choice by choice."""
    best, waiting = outcome, deque(outcome.trial.gentler())
    while waiting and most > 0:
        most -= 1
        simpler = attempt(waiting.popleft())
        if simpler.status == outcome.status and _kind(simpler) == _kind(outcome):
            best, waiting = simpler, deque(simpler.trial.gentler())
    return best


def _kind(outcome: Outcome) -> str:
    """The message without its numbers: what went wrong, wherever."""
    return "".join(letter for letter in outcome.message if not letter.isdigit())[:40]
