"""On how many kinds of machines the results of a study were made: they differ by rounding."""

from collections import Counter
from collections.abc import Iterable

from studies.sweep.standings import Standing
from studies.sweep.stored.known import Known

ANY = "any"
"""Stands for the machine of a portable result, which is equal on every one (studies.base.portable)."""


def machines_of(found: Iterable[Standing], known: Known) -> Counter[str]:
    """Results of each kind of machine, by its id, the most first; stale and missing ones left out."""
    counts: Counter[str] = Counter()
    for standing in found:
        entry = known.entry(standing.task) if standing.status not in ("stale", "missing") else None
        if entry is not None:
            counts[entry.machine if entry.portable is None else ANY] += 1
    return Counter(dict(counts.most_common()))


def mixture(counts: Counter[str]) -> str | None:
    """A sentence for results that differ by rounding; None where all are of one kind."""
    if len(counts) < 2:
        return None
    parts = [
        f"{count} {'portable' if machine == ANY else f'of machine {machine}'}" for machine, count in counts.items()
    ]
    return f"made on {len(counts)} kinds of processors, whose results differ by rounding: {', '.join(parts)}"
