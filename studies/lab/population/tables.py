"""Tables of a population: errors of every body, and an analysis of the ten worst members of every organ."""

from collections.abc import Sequence

import numpy as np

from studies import Metric, Run, Status
from studies.metrics.contact import contact_facets
from studies.metrics.distribution import Distribution, Group, groups
from studies.metrics.judged import DISPLACEMENT, FORCE
from studies.metrics.metrics import contact_turn

WORST = 10
"""Number of members of each organ that are analysed."""


def members_of(runs: Sequence[Run]) -> str:
    """Every body on the members of every organ: the median, what 95 of 100 stay below, and the worst."""
    lines = [
        "| organ | body, surface nodes | members, failed | force: median [%] | 95 of 100 [%] | worst [%] "
        "| mean: median [%] | 95 of 100 [%] | worst [%] | largest reference uncertainty, force / mean [%] |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for group in groups(runs):
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
    """Median, bound of 95 of 100 and worst member; dashes where no member compares the quantity."""
    if not one.count:
        return ["–", "–", "–"]
    return [
        _with_interval(one.median, one.median_interval, signed),
        _with_interval(one.bound, one.bound_interval),
        f"{one.worst:{'+' if signed else ''}.2g} ({one.worst_member})",
    ]


def _number(value: float) -> str:
    return f"{value:.2g}" if value == value else "–"


def _with_interval(value: float, interval: tuple[float, float], signed: bool = False) -> str:
    """A number with the two ends of its 95 % interval in brackets."""
    sign = "+" if signed else ""
    low, high = (f"{end:{sign}.2g}" for end in interval)
    return f"{value:{sign}.2g} ({low} to {high})"


def worst_of(runs: Sequence[Run]) -> str:
    """Of every organ the members on which its finest body is farthest off, with what may explain it."""
    lines = [
        "| member | force [%] | mean [%] | rigid share of the error [%] | facets in contact "
        "| turn of the contact force [°] | rest shape [%] | warning |",
        "|---|---|---|---|---|---|---|---|",
    ]
    finest: dict[str, Group] = {group.organ: group for group in groups(runs)}  # recipes are in order of size
    for group in finest.values():
        failures = [run for run in group.runs if run.record.status != Status.OK]
        judged = [run for run in group.runs if run not in failures and DISPLACEMENT(run) == DISPLACEMENT(run)]
        for run in sorted(judged, key=DISPLACEMENT, reverse=True)[:WORST]:
            cells = [_value(FORCE, run, "+"), _value(DISPLACEMENT, run), _number(rigid_share(run))]
            cells += [f"{facets:.0f}" if (facets := contact_facets(run)) == facets else "–", _number(contact_turn(run))]
            cells += [_number(run.shape.distance * 100.0), _warning(run)]
            lines.append(f"| {run.case.scene.name} | " + " | ".join(cells) + " |")
        lines += [
            f"| {run.case.scene.name} | {run.record.status} |{' – |' * 5} {run.record.message} |" for run in failures
        ]
    return "\n".join(lines)


def _value(entry: Metric, run: Run, sign: str = "") -> str:
    value, uncertainty = entry(run), entry.uncertainty(run)
    return f"{value:{sign}.2g} ± {uncertainty:.1g}" if value == value else "–"


def _warning(run: Run) -> str:
    """The first warning of a run, without the name of its organ."""
    first = str(run.record.attributes.get("warnings", "")).split("; ")[0]
    return first.removeprefix(f"{run.case.scene.organ.shape}: ") or "–"


def rigid_share(run: Run) -> float:
    """Share of the squared displacement error over the true surface that one rigid motion explains [%].

    Translation and small rotation by least squares, weighted by area. It is near 100 where the whole organ is turned,
    as by a contact force that points the wrong way, and small where the error is local. NaN where nothing is compared.
    """
    errors = run.boundary_errors
    if errors is None:
        return float("nan")
    root = np.sqrt(errors.areas)[:, None]
    arms = errors.places - np.average(errors.places, axis=0, weights=errors.areas)
    columns = [np.tile(axis, (len(arms), 1)) for axis in np.eye(3)] + [np.cross(axis, arms) for axis in np.eye(3)]
    motions = np.stack([(root * column).ravel() for column in columns], axis=1)
    wrong = (root * errors.wrong).ravel()
    left = wrong - motions @ np.linalg.lstsq(motions, wrong)[0]
    return 100.0 * (1.0 - float(left @ left) / float(wrong @ wrong))
