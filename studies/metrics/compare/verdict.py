"""The meaning of a change of a number, given its uncertainty."""

from enum import StrEnum

ROUND_OFF = 1e-5
"""Relative difference below which numbers are equal: tables have six digits."""


class Verdict(StrEnum):
    """Relation of a number in one folder to that in the other."""

    SAME_BITS = "same bits"
    ROUND_OFF = "round-off"
    WITHIN_FLOOR = "within floor"
    MOVED = "moved"
    NOT_RESOLVABLE = "not resolvable"
    OTHER_MACHINE = "other machine"
    OTHER_REFERENCE = "other reference"


MEANING: dict[Verdict, str] = {
    Verdict.SAME_BITS: "the records of both folders are equal to the last bit, and so are the numbers",
    Verdict.ROUND_OFF: f"equal to a relative {ROUND_OFF:g}, which is what a table shows",
    Verdict.WITHIN_FLOOR: "the change is within the uncertainty of the reference, or within the spread of the timing",
    Verdict.MOVED: "the change is larger than that uncertainty",
    Verdict.NOT_RESOLVABLE: "the number has no stated uncertainty, or one folder lacks it",
    Verdict.OTHER_MACHINE: "a time from another machine; it is not compared",
    Verdict.OTHER_REFERENCE: "an error against another reference, or another published set; it is not compared",
}


def verdict_of(old: float, new: float, floor: float, same_bits: bool) -> Verdict:
    """The verdict on a number that was `old` and is `new`. floor: its uncertainty, NaN if none is stated; same_bits:
    whether the records from which it was computed are equal."""
    change = abs(new - old)
    if change != change:
        return Verdict.NOT_RESOLVABLE
    if change <= ROUND_OFF * max(abs(old), abs(new)):
        return Verdict.SAME_BITS if same_bits and change == 0.0 else Verdict.ROUND_OFF
    if floor != floor:
        return Verdict.NOT_RESOLVABLE
    return Verdict.WITHIN_FLOOR if change <= floor else Verdict.MOVED
