"""Numbers as text: a value with the uncertainty of its reference."""

import math

MISSING = "–"
UNRESOLVED_MARK = "†"
"""Mark of an error that is less than ten times the uncertainty of the reference."""
UNRESOLVED_NOTE = f"{UNRESOLVED_MARK} unresolved: the uncertainty of the reference is more than a tenth of this error"
MINUS = "−"


def value_cell(
    value: float, uncertainty: float = float("nan"), *, signed: bool = False, unresolved: bool = False
) -> str:
    """ "−50.8 ± 0.2 †": as many digits as its `uncertainty` has; three without one; a dash for NaN."""
    if value != value:
        return MISSING
    sign = "+" if signed else ""
    if not uncertainty > 0:
        return plain(value, sign)
    digits = max(0, -math.floor(math.log10(uncertainty)))
    mark = f" {UNRESOLVED_MARK}" if unresolved else ""
    return f"{value:{sign}.{digits}f} ± {uncertainty:.{digits}f}{mark}".replace("-", MINUS)


def plain(value: float, sign: str = "") -> str:
    """Three significant digits; whole numbers below a million without an exponent."""
    text = f"{value:{sign},.0f}" if 1e3 <= abs(value) < 1e6 else f"{value:{sign}.3g}"
    return text.replace("-", MINUS)


def signed_percent(value: float) -> str:
    """ "−35 %", "+0.3 %": whole from ten on, one digit below; "0.0 %" without a sign."""
    text = f"{value:+.{1 if abs(value) < 9.95 else 0}f}"
    return f"{'0.0' if text in ('+0.0', '-0.0') else text} %".replace("-", MINUS)
