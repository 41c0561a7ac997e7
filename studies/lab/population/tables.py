"""The table of a population: errors of every body on the members of every organ."""

from collections.abc import Sequence

from studies.lab.population.rows import Group
from studies.metrics.distribution import Distribution
from studies.metrics.judged import DISPLACEMENT, FORCE

FEW = 20
"""Members below which the 95th percentile would be the worst one: none is shown."""


def members_of(groups: Sequence[Group]) -> str:
    """Every body on the members of every organ: the median, what 95 of 100 stay below, and the worst."""
    lines = [
        "| organ | body, surface nodes | members, failed | force: median [%] | 95 of 100 [%] | worst [%] "
        "| mean: median [%] | 95 of 100 [%] | worst [%] | largest reference uncertainty, force / mean [%] |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for group in groups:
        force, mean = group.of(FORCE), group.of(DISPLACEMENT)
        if not mean.count:
            continue
        cells = [
            f"{mean.count}, {mean.lost}",
            *_spread(force, signed=True),
            *_spread(mean),
            f"{_number(force.floor)} / {_number(mean.floor)}",
        ]
        lines.append(f"| {group.organ} | {group.body} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _spread(one: Distribution, signed: bool = False) -> list[str]:
    """Median, bound of 95 of 100 and worst member; dashes where no member compares the quantity, or too few do."""
    if not one.count:
        return ["–", "–", "–"]
    return [
        _with_interval(one.median, one.median_interval, signed),
        _with_interval(one.bound, one.bound_interval) if one.count >= FEW else "–",
        f"{one.worst:{'+' if signed else ''}.2g} ({one.worst_member})",
    ]


def _number(value: float) -> str:
    return f"{value:.2g}" if value == value else "–"


def _with_interval(value: float, interval: tuple[float, float], signed: bool = False) -> str:
    """A number with the two ends of its 95 % interval in brackets."""
    sign = "+" if signed else ""
    low, high = (f"{end:{sign}.2g}" for end in interval)
    return f"{value:{sign}.2g} ({low} to {high})"
