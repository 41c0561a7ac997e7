"""The true shape behind a name and its parameters."""

import inspect
from collections.abc import Mapping
from typing import Any

from studies.base.lookup import lookup
from studies.geometry.organs import SHAPES
from studies.geometry.shape.levelset import Shape


def make_shape(name: str, parameters: Mapping[str, Any]) -> Shape:
    """The shape `name` of SHAPES with some parameters; raises StudyError for an unknown name, parameter or value."""
    make = lookup(name, SHAPES, "organ")
    known = inspect.signature(make).parameters
    for parameter in parameters:
        lookup(parameter, known, f"parameter of the {name}")
    return make(**parameters)
