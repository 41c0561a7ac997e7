"""The true shape behind a name and its parameters."""

import inspect
import numbers
from collections.abc import Mapping
from typing import Any

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.geometry.organs import SHAPES
from studies.geometry.shape.levelset import Shape


def make_shape(name: str, parameters: Mapping[str, Any]) -> Shape:
    """The shape `name` of SHAPES; `parameters` replace defaults of its function.

    Raises StudyError for an unknown name or parameter, and for a value that is no number or that the shape refuses.
    """
    make = lookup(name, SHAPES, "organ")
    signature = inspect.signature(make).parameters
    for parameter, value in parameters.items():
        lookup(parameter, signature, f"parameter of the {name}")
        none = value is None and signature[parameter].default is None
        if not none and (isinstance(value, bool) or not isinstance(value, numbers.Real)):
            raise StudyError(f"the {parameter} of the {name} is {value!r}; give a number")
    return make(**parameters)
