"""Arrays as text of a page: series in two bytes a number, positions as deflated differences between frames.

assets/data.js reads both.
"""

import base64
import zlib
from typing import Any

import numpy as np

LEVELS = 65534
"""Highest level of a series; the one above stands for no number."""
STEP = 1.8e-4
"""Between levels of positions, over the size of the body [1]: rounding moves a coordinate by half of that at most."""
DEEPEST = 30_000
"""Most levels of positions, so that a difference fits into two bytes."""


def pack_series(values: np.ndarray) -> dict[str, Any]:
    """Numbers (n,), NaN and infinities as missing, each rounded to 1/131,000 of their range."""
    finite = np.isfinite(values)
    low, high = (float(end) for end in (values[finite].min(), values[finite].max())) if finite.any() else (0.0, 0.0)
    # If all are equal up to round-off, every level has the same value.
    scale = LEVELS / (high - low) if high - low > np.finfo(float).tiny * LEVELS else 0.0
    levels = np.full(len(values), LEVELS + 1)
    levels[finite] = np.rint((values[finite] - low) * scale).astype(int)
    return {"low": low, "high": high, "data": _text(levels.astype("<u2").tobytes())}


def pack_frames(positions: np.ndarray, size: float) -> dict[str, Any]:
    """Positions (P, n, 3) [m] of a body of `size` [m]; with the step of the grid that they are rounded to."""
    low = positions.min(axis=(0, 1)).astype(float)
    extent = float((positions.max(axis=(0, 1)) - low).max())
    step = max(STEP * size, extent / DEEPEST)
    levels = np.rint((positions - low) / step).astype(np.int64)
    # Ordered by coordinate and node over time, all low bytes before all high ones, so that similar bytes are adjacent.
    change = np.ascontiguousarray(np.diff(levels, axis=0, prepend=0).astype("<i2").transpose(2, 1, 0))
    planes = change.view(np.uint8).reshape(-1, 2).T.tobytes()
    return {"shape": list(positions.shape[:2]), "low": low.tolist(), "step": step, "data": _deflated(planes)}


def pack_indices(indices: np.ndarray) -> str:
    """Whole numbers below 65,536, in their order."""
    return _deflated(indices.astype("<u2").tobytes())


def _deflated(content: bytes) -> str:
    return _text(zlib.compress(content, 9))


def _text(content: bytes) -> str:
    return base64.b64encode(content).decode("ascii")
