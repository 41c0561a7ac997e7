"""What a look at the machine finds."""

from dataclasses import dataclass
from enum import StrEnum


class Level(StrEnum):
    """How bad it is."""

    OK = "ok"
    NOTE = "note"
    """Something is left out or slower; the rest works."""
    FAULT = "fault"


@dataclass(frozen=True)
class Finding:
    """A check: its result in words, and the shell command that fixes it."""

    level: Level
    said: str
    mend: str = ""


def ok(said: str) -> Finding:
    """Nothing to do."""
    return Finding(Level.OK, said)


def note(said: str, mend: str = "") -> Finding:
    """Something is left out."""
    return Finding(Level.NOTE, said, mend)


def fault(said: str, mend: str) -> Finding:
    """Something that is needed is missing."""
    return Finding(Level.FAULT, said, mend)
