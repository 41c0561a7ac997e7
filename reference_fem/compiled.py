"""The decorator of compiled functions: numba, kept on disk (massspring.compile_cache, which holds no mechanics)."""

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

from massspring.compile_cache import kept

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(**options: Any) -> Callable[[Function], Function]:
    """Compile on first call, with numba's `options`."""

    def decorate(function: Function) -> Function:
        with kept():
            return njit(cache=True, **options)(function)  # pyright: ignore[reportReturnType]

    return decorate
