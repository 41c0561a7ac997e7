"""Whether a fit gains in other scenes what it gains in its own: a fit that only memorises gains nothing there."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

SHARE = 0.5
"""Of the share by which a fit lowers its own error: what a judged error must fall by."""


class Verdict(StrEnum):
    """The result of a fit."""

    HOLDS = "holds"
    MEMORISES = "memorises"
    UNRESOLVED = "not resolvable"


@dataclass(frozen=True)
class Compared:
    """An error without and with a fit, and the uncertainty of the reference, in one unit."""

    before: float
    after: float | None
    """None where the fitted body ended badly."""
    uncertainty: float


def verdict_of(fitted: Iterable[Compared], judged: Iterable[Compared]) -> Verdict | None:
    """The verdict on one quantity: root mean squares over the scenes fitted and over those judged.

    With errors f0, f1 and j0, j1 before and after: the fit lowers its own error by the share 1 - f1/f0 (by nothing,
    if f0 - f1 is within the uncertainty), and a judged one is due to fall by SHARE (1 - f1/f0) j0. Where j0 - j1
    differs from what is due by less than the uncertainty, the fit is unresolved. An error that the fit does not lower
    may rise in judged scenes by as much as it rises in its own. None where either side compares nothing.
    """
    own, others = list(fitted), list(judged)
    if not own or not others:
        return None
    if any(pair.after is None for pair in others):
        return Verdict.MEMORISES  # the fitted body did not come through
    (f0, f1, f_uncertainty), (j0, j1, j_uncertainty) = _means(own), _means(others)
    improves = f0 - f1 > f_uncertainty
    due = SHARE * (1.0 - f1 / f0) * j0 if improves else min(f0 - f1, 0.0)
    beyond = j0 - j1 - due
    if not abs(beyond) > j_uncertainty:
        return Verdict.UNRESOLVED
    if beyond < 0.0:
        return Verdict.MEMORISES
    return Verdict.HOLDS if improves else Verdict.UNRESOLVED


def worst(verdicts: Iterable[Verdict | None]) -> Verdict:
    """The verdict on all of them: one that memorises spoils it, one that holds is enough among unresolved ones."""
    kinds = set(verdicts)
    return next((one for one in (Verdict.MEMORISES, Verdict.HOLDS) if one in kinds), Verdict.UNRESOLVED)


def _means(pairs: Sequence[Compared]) -> tuple[float, float, float]:
    """Root mean squares of the errors before and after, and of the uncertainties; infinite for a body that is lost."""
    after = [math.inf if pair.after is None else pair.after for pair in pairs]
    return _rms([pair.before for pair in pairs]), _rms(after), _rms([pair.uncertainty for pair in pairs])


def _rms(values: Sequence[float]) -> float:
    return math.sqrt(sum(value**2 for value in values) / len(values))
