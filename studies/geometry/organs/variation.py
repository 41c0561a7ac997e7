"""Random but plausible organs, for studies of a population."""

import inspect
import zlib

import numpy as np

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.geometry.organs import SHAPES

COMMON = 0.7
"""Share of the spread that all lengths of one organ have in common: a long kidney is also wide."""
WIDEST = 0.3
"""Largest spread: beyond it the parts of an organ no longer fit together."""


def vary(name: str, seed: int, spread: float = 0.2) -> dict[str, float]:
    """Random parameters for `SHAPES[name]`, each within 1 - spread to 1 + spread times its default; JSON-able.

    All lengths share one random factor, and each has a smaller one that is independent. The wall varies independently
    of them, because filling thins it. The same seed gives the same organ. Raises StudyError for an unknown organ, a
    seed that is not a whole number >= 0, and a spread outside 0 to WIDEST.
    """
    shape = lookup(name, SHAPES, "organ")
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise StudyError(f"{name}: the seed {seed!r} is not a whole number from 0 on; give one such as 1")
    if not 0 <= spread <= WIDEST:
        raise StudyError(f"{name}: a spread of {spread} is outside 0 to {WIDEST}; 0.2 means 20 % up or down")
    rng = np.random.default_rng([int(seed), zlib.crc32(name.encode())])
    size = rng.uniform(-1.0, 1.0)
    values = {}
    for parameter in inspect.signature(shape).parameters.values():
        if parameter.default is None:  # the wall of a ball, which stays solid
            continue
        own = rng.uniform(-1.0, 1.0)
        share = own if parameter.name == "wall" else COMMON * size + (1.0 - COMMON) * own
        values[parameter.name] = float(parameter.default * (1.0 + spread * share))
    return values
