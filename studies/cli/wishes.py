"""Bounds as people type them: "3%", "3 %" and "0.03"; "1ms", "250us" and "0.5 ms"."""

import re

from studies.base.errors import StudyError

NUMBER = r"\s*([0-9]*\.?[0-9]+(?:[eE][+-]?[0-9]+)?)\s*"
PER_MS = {"s": 1e3, "ms": 1.0, "us": 1e-3, "µs": 1e-3, "μs": 1e-3}
"""Units of computing time for 1 ms of simulated time, in ms."""


def share(text: str, noun: str) -> float | None:
    """A share [1], None for no text. Raises StudyError for what is no share, or none above 0 and up to 1."""
    if not text:
        return None
    found = re.fullmatch(f"{NUMBER}(%?)\\s*", text)
    value = float(found[1]) / (100.0 if found[2] else 1.0) if found else 0.0
    if not 0.0 < value <= 1.0:
        raise StudyError(f"{noun} {text!r} is no tolerance; give a share above 0 and up to 100 %, such as 3% or 0.03")
    return value


def budget(text: str) -> float | None:
    """Computing over simulated time [1], from computing time per 1 ms simulated; None for no text. Raises as above."""
    if not text:
        return None
    found = re.fullmatch(f"{NUMBER}({'|'.join(PER_MS)})\\s*", text)
    value = float(found[1]) * PER_MS[found[2]] if found else 0.0
    if not 0.0 < value < float("inf"):
        raise StudyError(
            f"budget {text!r} is no time; give the computing time per 1 ms of simulated time, such as 1ms or 250us"
        )
    return value
