"""Units of length in files that do not name theirs: recognised by the size of organs, never taken without a word."""

from studies.base.errors import StudyError

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
ORGAN = 0.02, 0.6
"""Longest side [m] of an organ: from a foetal kidney to the lungs of an adult."""
NAMES = {"m": "metres", "cm": "centimetres", "mm": "millimetres"}


def check_unit(unit: str) -> None:
    """Raise StudyError unless `unit` is one of UNITS."""
    if unit not in UNITS:
        raise StudyError(f"unit {unit!r} is not known; use one of {', '.join(UNITS)}")


def likely_units(side: float) -> list[str]:
    """The units in which a longest side of `side` is that of an organ, the largest first."""
    return [unit for unit, factor in UNITS.items() if ORGAN[0] <= side * factor <= ORGAN[1]]


def unit_question(name: str, side: float) -> str:
    """What a person has to know to answer which unit a file has whose longest side is `side`."""
    likely = likely_units(side)
    if likely:
        guess = " or ".join(NAMES[unit] for unit in likely)
        return f"{name} does not say its unit; its longest side is {side:.4g}, the size of an organ in {guess}"
    return f"{name} does not say its unit; its longest side is {side:.4g}, which is no organ's size in m, cm or mm"


def settled_unit(name: str, side: float, unit: str | None) -> str:
    """`unit` when it is given, "m" when only metres fit an organ; raises StudyError when it must be given."""
    if unit is not None:
        check_unit(unit)
        return unit
    if likely_units(side) == ["m"]:
        return "m"
    likely = (likely_units(side) or ["mm"])[-1]
    raise StudyError(f"{unit_question(name, side)}; say --unit {likely} (or another of {', '.join(UNITS)})")
