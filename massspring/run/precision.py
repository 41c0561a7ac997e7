"""A state in single precision: half the memory to move, twice the numbers in a vector register."""

from dataclasses import replace
from typing import Any, Literal

import numpy as np

from massspring.errors import MassSpringError
from massspring.layout.jacobian_pattern import OF_EACH_VOLUME
from massspring.layout.sell_chunks import aligned
from massspring.layout.state import State
from massspring.methods.capabilities import No
from massspring.methods.method import Method

Precision = Literal["float64", "float32"]
KEPT_DOUBLE = frozenset({"sums", "matrix", "scale", "coarse_scale", "moment", *OF_EACH_VOLUME})
"""Arrays that stay float64: sums over many nodes and the systems solved with them. They are short and cost no time."""


def check_precision(precision: str, method: Method) -> None:
    """Raises MassSpringError for a precision other than float64 and float32, and for float32 if `method` does not
    support it."""
    if precision not in ("float64", "float32"):
        raise MassSpringError(f"unknown precision '{precision}'; choose float64 or float32")
    supported = method.capabilities.float32
    if precision == "float32" and isinstance(supported, No):
        raise MassSpringError(
            f"method '{method.name}' runs in float64 only, {supported.because}; "
            "leave precision at float64, or take implicit_volume"
        )


def in_precision(state: State, precision: Precision) -> State:
    """`state` with the arrays of its nodes, springs and volumes as `precision`; float64 leaves it as it is.

    The memory of the method and the arrays of thin probes stay in double precision.
    """
    if precision == "float64":
        return state
    rows = None if state.rows is None else _cast(state.rows, np.dtype(np.float32))
    parts = {name: _cast(getattr(state, name), np.dtype(np.float32)) for name in ("model", "nodes", "contacts", "work")}
    return replace(state, rows=rows, **parts)


def _cast(part: Any, real: np.dtype) -> Any:
    """A (nested) tuple of arrays with its float64 arrays converted to `real`."""
    changed = {}
    for name, value in part._asdict().items():
        if isinstance(value, tuple):
            changed[name] = _cast(value, real)
        elif isinstance(value, np.ndarray) and value.dtype == np.float64 and name not in KEPT_DOUBLE:
            changed[name] = aligned(value.shape, real)
            changed[name][...] = value
    return part._replace(**changed)
