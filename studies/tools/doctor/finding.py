"""The result of a check of the machine."""

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
    """A check: its result as a sentence, and the shell command that repairs a fault."""

    level: Level
    sentence: str
    mend: str = ""


def ok(sentence: str) -> Finding:
    """Nothing to do."""
    return Finding(Level.OK, sentence)


def note(sentence: str, mend: str = "") -> Finding:
    """Something is left out or slower."""
    return Finding(Level.NOTE, sentence, mend)


def fault(sentence: str, mend: str) -> Finding:
    """Something that is needed is missing."""
    return Finding(Level.FAULT, sentence, mend)
