"""Numbers as text: a value with the uncertainty of its reference."""

import math

from studies.meshing.bounds import FEW, SHAPE, SHAPE_VOLUME
from studies.metrics.wish import HOLLOW, SOLID

MISSING = "–"
UNRESOLVED_MARK = "†"
"""Mark of an error that is less than ten times the uncertainty of the reference."""
UNRESOLVED_NOTE = f"{UNRESOLVED_MARK} unresolved: the uncertainty of the reference is more than a tenth of this error"
FEW_MARK = "‡"
FEW_NOTE = f"{FEW_MARK} a sphere or capsule touches fewer than {FEW} facets: its force may be off by tens of percent"
DISTURBED_MARK = "¶"
DISTURBED_NOTE = f"{DISTURBED_MARK} other programs disturbed the timing: its times may be too long, and have no ±"
UNCONVERGED_MARK = "§"
"""Mark of a method without `Capabilities.converged`."""
UNCONVERGED_NOTE = (
    f"{UNCONVERGED_MARK} not converged: the answer depends on the step and on the order of elements, which ± does not "
    "contain"
)
UNTESTED_MARK = "‖"
UNTESTED_NOTE = f"{UNTESTED_MARK} no organ on which the rule of the 90 of 100 rests was under such a load"
MISSED_MARK = "*"
MISSED_NOTE = (
    f"{MISSED_MARK} misses the target: force within {SOLID[0]:g} %, mean displacement within {SOLID[1]:g} % (hollow "
    f"organs {HOLLOW[0]:g} and {HOLLOW[1]:g} %), shape within {SHAPE:g} % of the size, its volume within "
    f"{SHAPE_VOLUME:g} %"
)
MINUS = "−"


def value_cell(
    value: float,
    uncertainty: float = float("nan"),
    *,
    signed: bool = False,
    unresolved: bool = False,
    missed: bool = False,
) -> str:
    """ "−50.8 ± 0.2 † *": as many digits as its `uncertainty` has; three without one; a dash for NaN."""
    if value != value:
        return MISSING
    sign, miss = "+" if signed else "", f" {MISSED_MARK}" if missed else ""
    if not uncertainty > 0:
        return plain(value, sign) + miss
    digits = max(0, -math.floor(math.log10(uncertainty)))
    mark = f" {UNRESOLVED_MARK}" if unresolved else ""
    return f"{value:{sign}.{digits}f} ± {uncertainty:.{digits}f}{mark}{miss}".replace("-", MINUS)


def plain(value: float, sign: str = "") -> str:
    """Three significant digits; whole numbers below a million without an exponent."""
    text = f"{value:{sign},.0f}" if 1e3 <= abs(value) < 1e6 else f"{value:{sign}.3g}"
    return text.replace("-", MINUS)
