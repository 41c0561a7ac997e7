"""How a trial ends: ok, or a failure with a name; everything else is unexplained."""

import time
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar, Protocol

from massspring import MassSpringError, simulate
from studies.base.errors import StudyError
from studies.stress.surroundings import setup_of
from studies.stress.trial import PLAIN, Trial
from studies.stress.truths import broken, named, other_bits

UNEXPLAINED = "unexplained"
SECONDS = 20.0
"""After which a trial is given up."""


class Drawn(Protocol):
    """A trial of any campaign: a dataclass of its choices."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def number(self) -> int:
        """Which one of its seed."""
        ...

    @property
    def line(self) -> str:
        """The command that repeats it."""
        ...

    @property
    def changed(self) -> dict[str, Any]:
        """The choices that are not the gentlest."""
        ...


@dataclass(frozen=True)
class Outcome:
    """Of a trial."""

    trial: Drawn
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
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            status, message = _run(trial)
        except (MassSpringError, StudyError) as refused:
            status, message = "refused", str(refused)
        except Exception as error:  # whatever it is, it has no name
            status, message = UNEXPLAINED, f"{type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}"
    return Outcome(trial, status, message, time.perf_counter() - begun)


def _run(trial: Trial) -> tuple[str, str]:
    setup = setup_of(trial)
    history = simulate(setup, time_limit=SECONDS)
    if history.outcome != "finished":
        return history.outcome, history.message
    wrong = broken(setup, history) or other_bits(setup, history)
    return (UNEXPLAINED, wrong) if wrong else named(setup, history)


def simplest(outcome: Outcome, most: int = 200, attempt: Attempt = tried, plain: Mapping[str, Any] = PLAIN) -> Outcome:
    """A trial with as few choices off the gentlest, `plain`, as still ends in that status, tried choice by choice."""
    found, waiting = outcome, deque(_gentler(outcome.trial, plain))
    while waiting and most > 0:
        most -= 1
        simpler = attempt(waiting.popleft())
        if simpler.status == outcome.status and _kind(simpler) == _kind(outcome):
            found, waiting = simpler, deque(_gentler(simpler.trial, plain))
    return found


def _gentler(trial: Drawn, plain: Mapping[str, Any]) -> Iterable[Drawn]:
    """The trial with one choice more at its gentlest, or half-way there."""
    for name in trial.changed:
        yield replace(trial, **{name: plain[name]})
    for name in ("nodes", "steps"):
        value = getattr(trial, name)
        if value > 2 * plain[name]:
            yield replace(trial, **{name: int(value // 2 // plain["steps"] * plain["steps"] or value // 2)})


def _kind(outcome: Outcome) -> str:
    """The message without its numbers: what went wrong, wherever."""
    return "".join(letter for letter in outcome.message if not letter.isdigit())[:40]
