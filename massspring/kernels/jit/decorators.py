"""The decorators of all kernels: numba, kept on disk (massspring.compile_parts)."""

from collections.abc import Callable
from typing import Any, TypeVar

from massspring.compile_parts import kept_function

Function = TypeVar("Function", bound=Callable[..., Any])

OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True}
"""Division follows IEEE: a zero gives inf, and the run has diverged; other threads run meanwhile."""
WITHIN: dict[str, Any] = {"_nrt": False, "forceinline": True, "no_cpython_wrapper": True}
"""Part of the caller, and nothing for Python."""


def _jit(function: Function, **options: Any) -> Function:
    return kept_function(function, **OPTIONS, **options)


def compiled(function: Function) -> Function:
    """Compile on first call."""
    return _jit(function)


def njit_lean(function: Function) -> Function:
    """As `compiled`, without numba's runtime: what would allocate memory or make an array does not compile.

    No references to arrays are counted.
    """
    return _jit(function, _nrt=False)


def njit_inlined(function: Function) -> Function:
    """As `njit_lean`, and always part of its caller, which is compiled too: Python cannot call it."""
    return _jit(function, **WITHIN)


def njit_exposed(function: Function) -> Function:
    """As `njit_inlined`, for what Python calls as well: a method in Python, a test."""
    return _jit(function, _nrt=False, forceinline=True)


def njit_ignoring_nan(function: Function) -> Function:
    """As `njit_inlined`, for maxima along arrays: a vector register compares several. NaN makes them anything."""
    return _jit(function, **WITHIN, fastmath={"nnan", "nsz"})


def njit_reassociated(function: Function) -> Function:
    """As `njit_inlined`, for sums along arrays: terms may be added in any order, so a register adds several."""
    return _jit(function, **WITHIN, fastmath={"reassoc", "contract"})
