"""Counts in words: with their noun, of a plan kind by kind, and of cases by how they ended."""

from collections import Counter
from collections.abc import Iterable


def counted(number: int, one: str, several: str | None = None) -> str:
    """ "1 case", "1,200 cases"; several: the plural where it is not `one` with an s, such as "bodies"."""
    return f"{number:,} {one if number == 1 else several or f'{one}s'}"


def amounts(kinds: Counter[str]) -> str:
    """ "3 cases, 6 reference solutions, 9 published references, 1 timing", by kind: never a sum."""
    words = {"case": "case", "reference": "reference solution", "copy": "published reference", "timing": "timing"}
    return ", ".join(counted(kinds[kind], word) for kind, word in words.items() if kinds[kind])


def status_counts(statuses: Iterable[str]) -> str:
    """ "16 ok, 2 stale": ok first, then by number."""
    counts = Counter(status.replace("-", " ") for status in statuses)
    return ", ".join(f"{n} {word}" for word, n in sorted(counts.items(), key=lambda c: (c[0] != "ok", -c[1], c[0])))


def readable(name: str) -> str:
    """A name of the code as words: "implicit_volume" -> "implicit volume"."""
    return name.replace("_", " ").replace("-", " ")


def heading(name: str) -> str:
    """The same with a capital letter."""
    words = readable(name)
    return words[:1].upper() + words[1:]
