"""Tables of a population: errors of every body, an analysis of the ten worst members of every organ, and how often the
comparison of two meshes detects a member whose error is too large."""

from collections.abc import Sequence

import numpy as np

from studies import Metric, Run, Status
from studies.lab.population.warning import Judgement, judgements, tally
from studies.metrics.distribution import Distribution, Group, groups
from studies.metrics.judged import DISPLACEMENT, FORCE
from studies.metrics.metrics import contact_facets, contact_turn
from studies.metrics.trust import ENOUGH

WORST = 10
"""Number of members of each organ that are analysed."""
CHOSEN_ON = {"liver": 27, "kidney": 27, "stomach": 27, "spleen": 30, "bladder": 30}
"""Members of each organ, the first ones, on which the rule of the warning was chosen (studies.metrics.trust)."""


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


def trust_of(runs: Sequence[Run]) -> str:
    """How often the comparison of two meshes names a member whose finer body is beyond the target, and doubts one that
    is within, of the members on which its rule was chosen and of those drawn later; and how many bodies with fewer
    nodes, which are never trusted, are beyond the target and yet alike."""
    comparisons = judgements(runs)
    lines = [
        "| organ | chosen on: beyond the target, named | within it, doubted "
        "| judged on: beyond the target, named | within it, doubted | fewer nodes: beyond the target, alike |",
        "|---|---|---|---|---|---|",
    ]
    organs: dict[str, list[Judgement]] = {}
    for one in comparisons:
        organs.setdefault(_organ(one), []).append(one)
    for organ, some in [*organs.items(), ("all", comparisons)]:
        fine = [one for one in some if one.nodes >= ENOUGH]
        earlier = [one for one in fine if _number_of(one) < CHOSEN_ON.get(_organ(one), 0)]
        later = [one for one in fine if one not in earlier]
        cells = []
        for part in (earlier, later):
            count = tally(part)
            cells += [f"{count.beyond}, {count.named}", f"{count.within}, {count.doubted}"] if part else ["–", "–"]
        coarse = [one for one in some if one.nodes < ENOUGH]
        beyond = [one for one in coarse if not one.within]
        cells.append(f"{len(beyond)}, {sum(one.alike for one in beyond)}" if coarse else "–")
        lines.append(f"| {organ} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _organ(one: Judgement) -> str:
    return one.scene.split("_")[0]


def _number_of(one: Judgement) -> int:
    return int(one.scene.rsplit("_", 1)[1])
