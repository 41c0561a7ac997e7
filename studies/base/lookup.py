"""Names that a person typed: the known thing, or the nearest match in one sentence."""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import TypeVar, overload

from studies.base.errors import StudyError

T = TypeVar("T")
LETTERS = 100
"""Of a list of names; a longer one says less than the nearest name alone."""
ALL = {
    **{noun: f"organbench list {noun}s" for noun in ("scene", "organ", "method", "metric")},
    "study": "organbench list studies",
    "command": "organbench --help",
}
"""Noun -> the command that shows every name."""


@overload
def lookup(name: str, items: Mapping[str, T], noun: str) -> T: ...
@overload
def lookup(name: str, items: Iterable[str], noun: str) -> str: ...
def lookup(name, items, noun):
    """The item of `items` called `name`: its value when `items` is a mapping, the name itself otherwise.

    Raises StudyError: "unknown scene 'bal_squeeze'; did you mean 'ball_squeeze' (`organbench list scenes` shows all)?".
    """
    names = list(items)
    if name in names:
        return items[name] if isinstance(items, Mapping) else name
    raise StudyError(f"unknown {noun} {name!r}; {_answer(name, sorted(set(names)), noun)}")


def _answer(name: str, names: list[str], noun: str) -> str:
    if not names:
        return "none are known"
    listing = _listing(names, noun)
    by_lower = {other.lower(): other for other in names}
    matches = get_close_matches(str(name).lower(), by_lower, n=1, cutoff=0.5)
    return f"did you mean {by_lower[matches[0]]!r} ({listing})?" if matches else listing


def _listing(names: list[str], noun: str) -> str:
    """All names where they are few, else the command that shows them, else the first of them."""
    listing = "known are " + ", ".join(names)
    if len(listing) <= LETTERS:
        return listing
    if noun in ALL:
        return f"`{ALL[noun]}` shows all"
    shown = max(1, listing.count(", ", 0, LETTERS))
    return f"known are {', '.join(names[:shown])} and {len(names) - shown} more"
