"""The largest time step of a scene: predicted from the largest frequency, then bracketed by runs on either side."""

from dataclasses import dataclass

from massspring import StepLimit
from studies.runs.case import Case
from studies.runs.prepare import prepare
from studies.runs.run import record_of
from studies.store.record import Status

BELOW, ABOVE = 0.95, 1.10
"""Fractions of the predicted limit that are run. Contact and large strain move the true limit by a few per cent."""
FAR_BEYOND = (2.0, 20.0)
"""Multiples of the explicit limit at which a method without a limit is run."""
WIDER, MOST_RUNS = 1.25, 8
"""Where the prediction fails the bracket is widened by this factor, a run at a time."""
STEPS_PER_FRAME = 100
"""Rounding a frame to whole steps then moves the step by 1 % at most, never up."""


@dataclass(frozen=True)
class SafeStep:
    """A predicted limit and what happened on either side of it."""

    limit: StepLimit
    auto: float
    """The step that dt = "auto" takes [s]."""
    trials: tuple[tuple[float, Status], ...]
    """(time step [s], how the run ended), ascending."""
    conditionally_stable: bool = True
    """False for a method whose steps have no limit of stability; `limit` is then that of explicit methods."""

    @property
    def margin(self) -> float:
        """How many times the step of dt = "auto" fits into the limit [1]."""
        return self.limit.damped / self.auto

    @property
    def bracket(self) -> tuple[float, float] | None:
        """The longest step that held and the next, which diverged [s]; None without such a pair."""
        for (below, calm), (above, wild) in zip(self.trials, self.trials[1:], strict=False):
            if calm != Status.DIVERGED and wild == Status.DIVERGED:
                return below, above
        return None

    @property
    def verified(self) -> bool:
        """Whether the limit lies where it was predicted: between a step that holds and one that diverges.

        Where there is none, whether no run diverged.
        """
        if not self.conditionally_stable:
            return all(status != Status.DIVERGED for _, status in self.trials)
        bracket = self.bracket
        return bracket is not None and bracket[0] < self.limit.damped < bracket[1]

    @property
    def verdict(self) -> str:
        """A sentence on whether the runs confirm the prediction."""
        if not self.conditionally_stable:
            held = "verified" if self.verified else "not verified"
            return f"no stability limit, {held}; accuracy alone limits the step: try half of it and compare"
        if self.verified:
            return "verified"
        if self.bracket is None:
            return "not verified: found no stable step next to an unstable one"
        if self.bracket[0] > self.limit.damped:
            return "not verified: the limit is longer than predicted; many kept volumes take the stiffest modes away"
        return f"not verified: the limit is shorter than predicted; keep dt below {1e3 * self.bracket[0]:.3g} ms"


def safe_step(case: Case) -> SafeStep:
    """Predicts and verifies with the whole scene: contact, damping, constraint and all that moves.

    Where the run below diverges, or the one above does not, shorter or longer steps are tried until a bracket is found.
    Raises StudyError or MassSpringError for a case that cannot be prepared.
    """
    prepared = prepare(case)
    limit, auto = prepared.limit, prepared.setup.clock.dt
    if not case.method.capabilities.conditionally_stable:
        longer = [_trial(case, factor * limit.damped) for factor in FAR_BEYOND]
        return SafeStep(limit, auto, tuple(longer), conditionally_stable=False)
    trials = [_trial(case, fraction * limit.damped) for fraction in (BELOW, ABOVE)]
    while len(trials) < MOST_RUNS and trials[0][1] == Status.DIVERGED:
        trials.insert(0, _trial(case, trials[0][0] / WIDER))
    while len(trials) < MOST_RUNS and trials[-1][1] != Status.DIVERGED:
        trials.append(_trial(case, trials[-1][0] * WIDER))
    return SafeStep(limit, auto, tuple(trials))


def _trial(case: Case, dt: float) -> tuple[float, Status]:
    frames = max(1, int(case.scene.duration / (STEPS_PER_FRAME * dt)))
    record = record_of(case.replaced(dt=dt, frames=frames, beyond_limit=True))
    return float(record.attributes.get("dt", dt)), record.status
