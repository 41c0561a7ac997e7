"""Names that a person typed: the known thing, or the nearest match in one sentence."""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import TypeVar, overload

from studies.base.errors import StudyError

T = TypeVar("T")
SHOWN = 20  # more names than this say less than the suggestion alone


@overload
def lookup(name: str, known: Mapping[str, T], noun: str) -> T: ...
@overload
def lookup(name: str, known: Iterable[str], noun: str) -> str: ...
def lookup(name, known, noun):
    """The item of `known` called `name`: its value when `known` is a mapping, the name itself otherwise.

    Raises StudyError: "unknown scene 'bal_squeeze'; did you mean 'ball_squeeze' (known are ball_clamped, ...)?".
    """
    names = list(known)
    if name in names:
        return known[name] if isinstance(known, Mapping) else name
    raise StudyError(f"unknown {noun} {name!r}; {_answer(name, names)}")


def _answer(name: str, names: list[str]) -> str:
    if not names:
        return "none are known"
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    listing = "known are " + ", ".join(sorted(names)[:SHOWN]) + more
    by_lower = {other.lower(): other for other in names}
    matches = get_close_matches(str(name).lower(), by_lower, n=1, cutoff=0.5)
    return f"did you mean {by_lower[matches[0]]!r} ({listing})?" if matches else listing
