"""The decorator of compiled functions: numba with a cache on disk (massspring.compile_parts, which contains no
mechanics)."""

from collections.abc import Callable
from typing import Any, TypeVar

from massspring.compile_parts import kept_function

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(**options: Any) -> Callable[[Function], Function]:
    """Compile on first call, with numba's `options`."""
    return lambda function: kept_function(function, **options)
