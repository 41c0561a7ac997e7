"""The decorators of all kernels: numba, kept on disk (massspring.compile_cache)."""

from collections.abc import Callable
from typing import Any, TypeVar

import numba

from massspring.compile_cache import kept

Function = TypeVar("Function", bound=Callable[..., Any])

OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
"""Kept on disk; division follows IEEE: a zero gives inf, and the run has diverged; other threads run meanwhile. No
wrapper is made for callers in C."""
WITHIN: dict[str, Any] = {"_nrt": False, "forceinline": True, "no_cpython_wrapper": True}
"""Part of the caller, and no wrapper for Python: to unpack tuples of sixty arrays is a third of all compiling."""


def _jit(function: Function, **options: Any) -> Function:
    with kept():
        return numba.njit(**OPTIONS, **options)(function)  # pyright: ignore[reportReturnType]


def compiled(function: Function) -> Function:
    """Compile on first call."""
    return _jit(function)


def njit_lean(function: Function) -> Function:
    """As `compiled`, without numba's runtime: what would allocate memory or make an array does not compile.

    No references are counted. With them a call that is given a tuple of twenty arrays takes 200 ns, of a step's 15 µs.
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
