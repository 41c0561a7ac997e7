"""Checks of the settings of a case that need neither mesh nor body."""

import math
from dataclasses import fields, is_dataclass
from numbers import Real
from typing import Any

from massspring import MassSpringError
from massspring.run.precision import check_precision
from studies.base.errors import StudyError

RECORDABLE = ("surface",)
"""Fields that a case may record on request: energies, and positions of the outer surface for a replay."""


def check_settings(case: Any) -> None:
    """Raises StudyError for the first invalid setting of a `studies.runs.case.Case`."""
    if isinstance(case.method, type) or not is_dataclass(case.method):
        name = getattr(case.method, "__name__", repr(case.method))
        raise StudyError(f"the method is {name}; give an object, such as Free()")
    for owner in (case.body, case.method):
        for setting in fields(owner):
            value = getattr(owner, setting.name)
            if type(setting.default) in (int, float) and not _finite(value):
                raise StudyError(f"{setting.name} is {value!r}; give a finite number, such as {setting.default!r}")
    if not _positive(case.body.stiffness):
        raise StudyError(f"stiffness is {case.body.stiffness!r}; it must be positive, 1 matches the tissue")
    weights = getattr(case.body, "weights", None)
    if weights is not None and not (isinstance(weights, tuple) and len(weights) == 4 and all(map(_finite, weights))):
        raise StudyError(f"weights are {weights!r}; give four finite numbers, such as (1, 0.5, 0.5, 1)")
    if case.dt != "auto" and not _positive(case.dt):
        raise StudyError(f"dt is {case.dt!r} s; it must be positive, or 'auto' for a fraction of the stability limit")
    if not _positive(case.dt_fraction):
        raise StudyError(f"dt_fraction is {case.dt_fraction!r}; it must be positive, 1 is the stability limit itself")
    if case.frames is not None and (type(case.frames) is not int or case.frames < 1):
        raise StudyError(f"frames is {case.frames!r}; give a whole number from 1 on, or None for the scene's own")
    try:
        check_precision(case.precision, case.method)  # pyright: ignore[reportArgumentType]
    except MassSpringError as error:
        raise StudyError(str(error)) from error
    if not isinstance(case.recorded, tuple):
        raise StudyError(f"recorded is {case.recorded!r}; give a tuple, such as ({RECORDABLE[0]!r},)")
    unknown = sorted(set(case.recorded) - set(RECORDABLE))
    if unknown:
        raise StudyError(f"no extra field is called '{unknown[0]}'; there are {', '.join(RECORDABLE)}")


def _positive(value: object) -> bool:
    return _finite(value) and value > 0  # pyright: ignore[reportOperatorIssue]


def _finite(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
