"""A metric over the members of a population: median, range, worst member, and how sure of each one may be."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from studies.metrics.metric import Metric
from studies.metrics.run import Run
from studies.runs.recipe_text import body_words
from studies.store.record import Status

BOUND = 0.95
"""Share of the members that a bound holds for."""
RESAMPLES = 2000
ENOUGH = 59
"""Members of which the worst one is above the bound of 95 % of all organs with 95 % confidence: 1 - 0.95^59 = 0.951
(Wilks, Annals of Mathematical Statistics 12 (1941) 91)."""


@dataclass(frozen=True)
class Distribution:
    """Of one metric, in its unit, for one body on the members of a population."""

    count: int
    """Members that were judged."""
    lost: int
    """Members of which nothing is known: not meshed, failed, without a reference."""
    median: float
    median_interval: tuple[float, float]
    """95 % confidence, from resampling."""
    middle: tuple[float, float]
    """From the 2.5 to the 97.5 percentile of the members."""
    bound: float
    """The 95th percentile of the absolute value: 95 of 100 members are at most that far off."""
    bound_interval: tuple[float, float]
    """95 % confidence, from resampling; too narrow above with few members."""
    worst: float
    """The value of largest absolute value."""
    worst_member: str
    floor: float
    """The largest uncertainty of a reference."""
    resolved: int
    """Members whose reference is known to a third of the median absolute error, or better."""

    @property
    def confidence(self) -> float:
        """That of all organs at least 95 % are no farther off than the worst member: 1 - 0.95^n [1]."""
        return 1.0 - BOUND**self.count


def distribution(values: Mapping[str, float], floors: Mapping[str, float], seed: int = 0) -> Distribution:
    """Of the members by name; NaN counts as lost. floors: the uncertainty of the reference of each [same unit].

    Intervals are percentile intervals of RESAMPLES resamples (Efron and Tibshirani, An Introduction to the Bootstrap,
    1993, chapter 13); a single member has none.
    """
    names = [name for name, value in values.items() if value == value]
    errors = np.array([values[name] for name in names])
    if not names:
        nothing = (np.nan, np.nan)
        return Distribution(0, len(values), np.nan, nothing, nothing, np.nan, nothing, np.nan, "", np.nan, 0)
    far = np.abs(errors)
    own = np.array([floors.get(name, np.nan) for name in names])
    return Distribution(
        count=len(names),
        lost=len(values) - len(names),
        median=float(np.median(errors)),
        median_interval=_interval(errors, np.median, seed),
        middle=(float(np.quantile(errors, 0.025)), float(np.quantile(errors, 0.975))),
        bound=float(np.quantile(far, BOUND)),
        bound_interval=_interval(far, _bound, seed),
        worst=float(errors[far.argmax()]),
        worst_member=names[int(far.argmax())],
        floor=float(np.nanmax(own)) if (own == own).any() else np.nan,
        resolved=int((own <= np.median(far) / 3.0).sum()),
    )


def _bound(values: np.ndarray, axis: int = -1) -> np.ndarray:
    return np.quantile(values, BOUND, axis=axis)


def _interval(values: np.ndarray, statistic: object, seed: int) -> tuple[float, float]:
    if len(values) < 2:
        return (np.nan, np.nan)
    from scipy.stats import bootstrap  # which takes a quarter of a second to load

    ends = bootstrap(
        (values,),
        statistic,
        n_resamples=RESAMPLES,
        method="percentile",
        vectorized=True,
        rng=np.random.default_rng(seed),
    ).confidence_interval
    return (float(ends.low), float(ends.high))


@dataclass(frozen=True)
class Group:
    """The runs of one body on the members of one organ."""

    organ: str
    body: str
    runs: tuple[Run, ...]

    def values(self, entry: Metric) -> tuple[dict[str, float], dict[str, float]]:
        """Member -> value, and -> uncertainty of its reference; NaN for a run that ended badly."""
        ok = {run.case.scene.name: run for run in self.runs if run.record.status == Status.OK}
        names = [run.case.scene.name for run in self.runs]
        nan = float("nan")
        return (
            {name: entry(ok[name]) if name in ok else nan for name in names},
            {name: entry.uncertainty(ok[name]) if name in ok else nan for name in names},
        )

    def of(self, entry: Metric) -> Distribution:
        """The distribution of a metric."""
        return distribution(*self.values(entry))


def groups(runs: Sequence[Run]) -> list[Group]:
    """Runs by organ and body, in their order; organs from files are "file"."""
    members: dict[tuple[str, str], list[Run]] = {}
    for run in runs:
        members.setdefault((run.case.scene.organ.shape, body_words(run.case.body)), []).append(run)
    return [Group(organ, body, tuple(some)) for (organ, body), some in members.items()]
