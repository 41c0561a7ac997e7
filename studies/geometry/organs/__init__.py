"""The organs, one file each: level function, box and attachments. To add one, write a file and a line in SHAPES."""

import inspect
import numbers
import zlib
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.geometry.organs.ball import ball_shape
from studies.geometry.organs.bladder import bladder_shape
from studies.geometry.organs.kidney import kidney_shape
from studies.geometry.organs.liver import liver_shape
from studies.geometry.organs.spleen import spleen_shape
from studies.geometry.organs.stomach import stomach_shape
from studies.geometry.shape.levelset import Shape

SHAPES: dict[str, Callable[..., Shape]] = {
    "ball": ball_shape,
    "liver": liver_shape,
    "stomach": stomach_shape,
    "kidney": kidney_shape,
    "spleen": spleen_shape,
    "bladder": bladder_shape,
}
COMMON = 0.7
"""Share of the spread that all lengths of one organ have in common: a long kidney is also wide."""
WIDEST = 0.3
"""Largest spread: beyond it the parts of an organ no longer fit together."""


def make_shape(name: str, parameters: Mapping[str, Any]) -> Shape:
    """The shape `name` of SHAPES; `parameters` replace defaults of its function. Raises StudyError for an unknown name
    or parameter, and for a value that is no number or that the shape refuses."""
    make = lookup(name, SHAPES, "organ")
    signature = inspect.signature(make).parameters
    for parameter, value in parameters.items():
        lookup(parameter, signature, f"parameter of the {name}")
        none = value is None and signature[parameter].default is None
        if not none and (isinstance(value, bool) or not isinstance(value, numbers.Real)):
            raise StudyError(f"the {parameter} of the {name} is {value!r}; give a number")
    return make(**parameters)


def vary(name: str, seed: int, spread: float = 0.2) -> dict[str, float]:
    """Random parameters of a plausible organ, each within 1 - spread to 1 + spread times its default; JSON-able.

    All lengths share one random factor, and each has a smaller one of its own. The wall varies independently, because
    filling thins it. The same seed gives the same organ. Raises StudyError for an unknown organ, a seed that is not a
    whole number >= 0, and a spread outside 0 to WIDEST.
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
