"""Results that are equal to the bit on every x86-64 machine: the settings that libraries read when they are loaded.

numba compiles for the processor that it runs on, and NumPy, MKL, OpenBLAS and the system's mathematical functions
choose their loops by it; other instructions round in another order. With these settings all of them use what every
x86-64 processor since 2009 has. Code is slower for it (docs/cluster.md).
"""

import os

from numpy._core._multiarray_umath import __cpu_dispatch__  # pyright: ignore[reportAttributeAccessIssue]

PORTABLE = "ORGANBENCH_PORTABLE"
"""Set where a process computes so."""
SETTINGS = {
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
    "NUMBA_DISABLE_INTEL_SVML": "1",
    "NPY_DISABLE_CPU_FEATURES": " ".join(__cpu_dispatch__),
    "MKL_CBWR": "COMPATIBLE",
    "OPENBLAS_CORETYPE": "Nehalem",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F",
}


def environment() -> dict[str, str]:
    """Variables of a process that is to compute so, given before it starts."""
    return {PORTABLE: "1", **SETTINGS}


def attributes() -> dict[str, str]:
    """What a record says of it: the settings, where this process was started with them, else nothing."""
    if not os.environ.get(PORTABLE):
        return {}
    return {"portable": ", ".join(f"{name}={value}" for name, value in SETTINGS.items() if value)}
