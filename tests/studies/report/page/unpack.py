"""What the script of report.html reads out of packed numbers, in Python."""

import base64
import zlib
from typing import Any

import numpy as np

from studies.report.page.pack import LEVELS


def unpack_series(packed: dict[str, Any]) -> np.ndarray:
    """What the page reads, (n,)."""
    levels = np.frombuffer(base64.b64decode(packed["data"]), "<u2")
    values = packed["low"] + (packed["high"] - packed["low"]) * (levels / LEVELS)
    return np.where(levels > LEVELS, np.nan, values)


def unpack_frames(packed: dict[str, Any]) -> np.ndarray:
    """What the page reads, (P, n, 3) [m]."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(packed["data"])), np.uint8).reshape(2, -1)
    count, nodes = packed["shape"]
    change = np.ascontiguousarray(planes.T).view("<i2").reshape(3, nodes, count).transpose(2, 1, 0)
    return np.asarray(packed["low"]) + packed["step"] * np.cumsum(change, axis=0, dtype=np.int64)
