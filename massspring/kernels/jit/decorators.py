"""Decorators of all kernels: numba with a cache on disk (massspring.compile_parts)."""

from collections.abc import Callable
from typing import Any, TypeVar

from massspring.compile_parts import kept_function

Function = TypeVar("Function", bound=Callable[..., Any])

OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True}
"""Division follows IEEE: division by zero gives inf, which ends a run as diverged. Kernels release the GIL."""
WITHIN: dict[str, Any] = {"_nrt": False, "forceinline": True, "no_cpython_wrapper": True}
"""For a function that is inlined into its callers and cannot be called from Python."""


def _jit(function: Function, **options: Any) -> Function:
    return kept_function(function, **OPTIONS, **options)


def compiled(function: Function) -> Function:
    """Compile on first call."""
    return _jit(function)


def njit_lean(function: Function) -> Function:
    """As `compiled`, without numba's runtime: code that allocates memory or creates an array does not compile.

    References to arrays are not counted.
    """
    return _jit(function, _nrt=False)


def njit_inlined(function: Function) -> Function:
    """As `njit_lean`, and always inlined into its compiled callers: Python cannot call it."""
    return _jit(function, **WITHIN)


def njit_exposed(function: Function) -> Function:
    """As `njit_inlined`, for functions that Python calls as well, such as a method or a test."""
    return _jit(function, _nrt=False, forceinline=True)


def njit_ignoring_nan(function: Function) -> Function:
    """As `njit_inlined`, for maxima along arrays: a vector register compares several numbers. The result for NaN is
    undefined."""
    return _jit(function, **WITHIN, fastmath={"nnan", "nsz"})


def njit_reassociated(function: Function) -> Function:
    """As `njit_inlined`, for sums along arrays: terms may be added in any order, so a register adds several."""
    return _jit(function, **WITHIN, fastmath={"reassoc", "contract"})
