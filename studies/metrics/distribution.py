"""Distribution of a metric over the members of a population: median, range, worst member, and their confidence."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from studies.metrics.metric import Metric
from studies.store.record import Status

BOUND = 0.95
"""Share of the members that a bound holds for."""
RESAMPLES = 2000
ENOUGH = 59
"""Number of members with which the worst one exceeds, with 95 % confidence, the bound for 95 % of all organs: 1 -
0.95^59 = 0.951 (Wilks, Annals of Mathematical Statistics 12 (1941) 91)."""


@dataclass(frozen=True)
class Distribution:
    """The distribution of one metric, in its unit, for one body on the members of a population."""

    count: int
    """Members with a value."""
    lost: int
    """Members without a value: not meshed, failed, or without a reference."""
    median: float
    median_interval: tuple[float, float]
    """95 % confidence, from resampling."""
    middle: tuple[float, float]
    """The 2.5th and 97.5th percentile of the members."""
    bound: float
    """The 95th percentile of the absolute value: 95 of 100 members have an error of at most that."""
    bound_interval: tuple[float, float]
    """95 % confidence, from resampling; too narrow above with few members."""
    worst: float
    """The value of largest absolute value."""
    worst_member: str
    floor: float
    """The largest uncertainty of a reference."""
    resolved: int
    """Members whose reference has an uncertainty of at most a third of the median absolute error."""

    @property
    def confidence(self) -> float:
        """Confidence that at least 95 % of all organs have an error of at most that of the worst member: 1 - 0.95^n
        [1]."""
        return 1.0 - BOUND**self.count


def distribution(values: Mapping[str, float], floors: Mapping[str, float], seed: int = 0) -> Distribution:
    """The distribution of `values`, member -> value; NaN counts as lost. floors: the uncertainty of the reference of
    each [same unit].

    Intervals are percentile intervals of RESAMPLES resamples (Efron and Tibshirani, An Introduction to the Bootstrap,
    1993, chapter 13); they are NaN for a single member.
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
    from scipy.stats import bootstrap  # the import takes a quarter of a second

    ends = bootstrap(
        (values,),
        statistic,
        n_resamples=RESAMPLES,
        method="percentile",
        vectorized=True,
        rng=np.random.default_rng(seed),
    ).confidence_interval
    return (float(ends.low), float(ends.high))


def distribution_of(rows: pd.DataFrame, entry: Metric) -> Distribution:
    """Of a metric in rows of studies.metrics.table, a member each. Raises KeyError for a column that they lack."""
    names = [str(name) for name in rows["scene"]]
    values, floors = (dict(zip(names, column, strict=True)) for column in columns_of(rows, entry))
    return distribution(values, floors)


def columns_of(rows: pd.DataFrame, entry: Metric) -> tuple[pd.Series, pd.Series]:
    """The values of a metric in such rows, NaN for what ended badly, and the uncertainties of their references."""
    value, floor = f"{entry.name} [{entry.unit}]", f"{entry.name} floor [{entry.unit}]"
    known = rows if floor in rows else rows.assign(**{floor: np.nan})  # a table without any has no such column
    return known.loc[:, value].where(known["status"] == Status.OK), known.loc[:, floor]
