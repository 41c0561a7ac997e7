"""The result of a check of the machine."""

from dataclasses import dataclass
from enum import StrEnum
from functools import partial


class Level(StrEnum):
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


ok, note, fault = (partial(Finding, level) for level in Level)
