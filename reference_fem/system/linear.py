"""Symmetric indefinite sparse systems: MKL Pardiso if installed, otherwise SciPy's SuperLU."""

import ctypes
import os
import shlex
import sys
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from reference_fem.errors import SingularTangent, SlowSolverWarning, SolveError

RESIDUAL_LIMIT = 1e-6
"""Largest relative residual of a solve (max norm) before the factors are rejected: Newton only needs a direction,
good factors leave 1e-10."""

SINGLE_FROM = 5_000
"""Unknowns from which factors are kept in single precision: half the time and half the memory of double precision.
Refinement brings a solve below RESIDUAL_LIMIT all the same (Carson and Higham, SIAM J. Sci. Comput. 40, 2018)."""

REFINEMENTS = 3
"""Most refinements of a solve by its residual in double precision. Factors in single precision leave 1e-5 and need
one."""

# Pardiso's control vector, numbered as in its manual minus one: own values on; nested dissection; refinement only
# after perturbed pivots; pivots perturbed below 1e-8; no scaling, no matching, pivots as they come. The tangent of a
# stable body with a finite bulk modulus is quasidefinite, so any order of pivots will do (Vanderbei, SIAM J. Optim. 5,
# 1995), at half the time of the analysis and four fifths of the factorisation. Indices from 0.
PARDISO_CONTROL = {0: 1, 1: 2, 7: 0, 9: 8, 10: 0, 12: 0, 20: 0, 34: 1}
# What is tried after that: scaling and weighted matching, both advised for saddle points; 2x2 pivots.
PARDISO_AFRESH = {10: 1, 12: 1, 20: 1}


def free_bytes():
    """Memory available without swapping [bytes]; the whole physical memory if the system does not report what is
    available."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    except OSError:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("MemAvailable:"))


def check_memory(needed: float, free: float, unknowns: int):
    """Raises SolveError for factors that do not fit into memory, before the machine swaps; both in bytes."""
    if needed > free:
        raise SolveError(
            f"factorising {unknowns} unknowns needs {needed / 1e9:.2g} GB of memory and {free / 1e9:.2g} GB are free: "
            f"use a coarser mesh (half as many unknowns need about 0.4 of it) or a larger machine"
        )


@cache
def load_pardiso():
    """The optional wrapper module, or None after one SlowSolverWarning in the life of the process."""
    # Where pip puts MKL's library; without a path pypardiso searches the whole environment for it, for 1.6 s or more.
    for path in sorted(Path(sys.prefix, "lib").glob("libmkl_rt*"))[:1]:
        os.environ.setdefault("PYPARDISO_MKL_RT", str(path))
    try:
        import pypardiso
    except (ImportError, OSError) as problem:  # where the library is missing, or cannot be loaded
        warnings.warn(
            f"pypardiso is not usable ({problem}): SciPy's solver gives the same answers, five to twenty times "
            f"slower; for speed run {shlex.join([sys.executable, '-m', 'pip', 'install', 'pypardiso'])}",
            SlowSolverWarning,
            stacklevel=3,
        )
        return None
    os.environ.setdefault("PYPARDISO_MKL_RT", pypardiso.ps.libmkl._name)  # pyright: ignore[reportOptionalMemberAccess]
    return pypardiso


class PardisoFactors:
    """LDLᵀ of an upper triangle (CSR, sorted, full diagonal); the analysis is done once per pattern.

    Large factors are in single precision, and pivots are not chosen, until `factor` is called with `afresh`.
    """

    def __init__(self, pypardiso: ModuleType):
        self.solver = pypardiso.PyPardisoSolver(mtype=-2)
        self.failure = sys.modules[pypardiso.PyPardisoSolver.__module__].PyPardisoError
        self.analysed = self.fresh = False
        self.upper = sp.csr_matrix((1, 1))

    @property
    def single(self):
        """Whether the factors are in single precision."""
        return self.upper.dtype == np.float32

    def call(self, phase: int, b: np.ndarray):
        """One phase of Pardiso on the matrix and right-hand sides, (n,) or (n, k) in Fortran's order.

        The wrapper's own call counts the indices of the matrix from 1, and turns the solutions into C's order, each
        time: a fifth of a solve.
        """
        x, solver, failed = np.zeros_like(b), self.solver, ctypes.c_int32(0)
        sizes = (1, 1, solver.mtype, phase, len(b)), (1 if b.ndim == 1 else b.shape[1],)
        front, count = ([ctypes.byref(ctypes.c_int32(size)) for size in some] for some in sizes)
        tables = self.upper.data, self.upper.indptr, self.upper.indices, solver.perm
        arrays = [array.ctypes.data_as(ctypes.POINTER(ctypes.c_int32)) for array in tables]
        handle = solver.pt.ctypes.data_as(ctypes.POINTER(ctypes.c_int64))
        control = solver.iparm.ctypes.data_as(ctypes.POINTER(ctypes.c_int32))
        quiet = ctypes.byref(ctypes.c_int32(0))
        solver._mkl_pardiso(handle, *front, *arrays, *count, control, quiet, b.ctypes, x.ctypes, ctypes.byref(failed))
        if failed.value:
            raise self.failure(failed.value)
        return x

    def needed_bytes(self):
        """Memory for the factors [bytes], after the analysis of the pattern, from Pardiso's iparm(15), (16) and (17)
        [kB]."""
        while_analysing, kept, factors = (int(self.solver.iparm[index]) for index in (14, 15, 16))
        return 1024 * max(while_analysing, kept + factors)

    def factor(self, upper: sp.csr_matrix, afresh: bool = False):
        """Factorises. The ordering of the first matrix is used for later ones, unless `afresh`; then this and all later
        factors are in double precision, with pivots matched to this matrix."""
        self.fresh = self.fresh or afresh
        single = len(upper.indptr) > SINGLE_FROM and not self.fresh
        if afresh or not self.analysed:
            self.release()
            self.analysed = False
        self.upper = sp.csr_matrix(upper, dtype=np.float32 if single else float)
        nothing = np.zeros(len(upper.indptr) - 1, self.upper.dtype)
        if not self.analysed:
            for index, value in (PARDISO_CONTROL | (PARDISO_AFRESH if afresh else {})).items():
                self.solver.iparm[index] = value
            self.solver.iparm[27] = int(single)
            self.call(11, nothing)
            self.analysed = True
            check_memory(self.needed_bytes(), free_bytes(), len(nothing))
        self.call(22, nothing)

    def solve(self, b: np.ndarray):
        """x of K x = b."""
        if not self.single:
            return self.call(33, np.asfortranarray(b))
        size, single = max(float(np.abs(b).max()), np.finfo(float).tiny), np.empty(b.shape, np.float32, "F")
        return size * self.call(33, np.divide(b, size, out=single, casting="same_kind")).astype(float)

    def release(self):
        """Releases the memory of MKL, which Python's garbage collector does not see."""
        if self.analysed:
            self.call(-1, np.zeros(len(self.upper.indptr) - 1, self.upper.dtype))
            self.analysed = False


class ScipyFactors:
    """SuperLU of the whole matrix, ordered for symmetric patterns, with mild pivoting."""

    failure = RuntimeError

    def __init__(self):
        self.solve_with: Callable = np.asarray

    def factor(self, upper: sp.csr_matrix, afresh: bool = False):
        """Factorises; `afresh`: with full partial pivoting."""
        whole = (upper + sp.triu(upper, 1).T).tocsc()
        threshold = 1.0 if afresh else 0.01
        options = {"SymmetricMode": not afresh}
        lu = splu(whole, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=threshold, options=options)
        self.solve_with = lu.solve

    def solve(self, b: np.ndarray):
        """x of K x = b."""
        return self.solve_with(b)

    def release(self):
        self.solve_with = np.asarray


class SymmetricSolver:
    """Solves K x = b for a K given by its upper triangle; checks solutions by their residual.

    Factorises D K D, D = |diag K|^-1/2: in K the entries of pressures are 1e-18 of those of displacements. Raises
    SolveError when K is singular to working precision.
    """

    def __init__(self, backend: str = "auto"):
        pypardiso = load_pardiso() if backend in ("auto", "pardiso") else None
        if backend == "pardiso" and pypardiso is None:
            raise SolveError("the solver 'pardiso' was asked for but pypardiso is not installed: use 'auto'")
        self.factors = PardisoFactors(pypardiso) if pypardiso else ScipyFactors()
        self.upper, self.scale = sp.csr_matrix((1, 1)), np.ones(1)

    def factor(self, upper: sp.csr_matrix):
        """Factorises K, given by its upper triangle; raises SingularTangent."""
        size = np.abs(upper.diagonal())
        self.scale = 1.0 / np.sqrt(np.where(size > 0.0, size, 1.0))
        rows = np.repeat(self.scale, np.diff(upper.indptr))
        scaled = upper.data * rows * self.scale[upper.indices]
        pattern = (one.astype(np.int32, copy=False) for one in (upper.indices, upper.indptr))
        self.upper = sp.csr_matrix((scaled, *pattern), shape=upper.shape)
        self.try_factor(afresh=False)

    def try_factor(self, afresh: bool):
        try:
            self.factors.factor(self.upper, afresh)
        except self.factors.failure as problem:
            raise SingularTangent(
                f"the tangent matrix of {len(self.upper.indptr) - 1} unknowns cannot be factorised ({problem}): "
                f"part of the body may be free to move, hold it"
            ) from problem

    def solve(self, b: np.ndarray, checked: bool = True):
        """x with |D (K x - b)| <= RESIDUAL_LIMIT |D b|, of the shape of b, (n,) or (n, k) for k right-hand sides.

        One fresh analysis in double precision is tried before giving up. checked=False skips the residual: for further
        right-hand sides with factors that another one has checked. The check takes as long as the solve.
        """
        scale = self.scale.reshape(-1, *[1] * (b.ndim - 1))
        b = scale * b
        if not checked:
            return scale * self.factors.solve(b)
        x, misfit = self.refined(b)
        if misfit > RESIDUAL_LIMIT:
            self.try_factor(afresh=True)
            x, misfit = self.refined(b)
        if not misfit <= RESIDUAL_LIMIT:
            raise SingularTangent(
                f"the tangent matrix of {len(self.upper.indptr) - 1} unknowns is singular to working precision "
                f"(relative residual {misfit:.1e}, limit {RESIDUAL_LIMIT:.0e}): part of the body may be free to move, "
                f"hold it"
            )
        return scale * x

    def refined(self, b: np.ndarray):
        """(x of D K D x = b, refined if its residual is too large; largest entry of the residual over that of b)."""
        x, size = self.factors.solve(b), np.abs(b).max() or 1.0
        for attempt in range(REFINEMENTS + 1):
            with np.errstate(invalid="ignore", over="ignore"):
                residual = b - self.product(x)
                misfit = np.abs(residual).max() / size
            if misfit <= RESIDUAL_LIMIT or not np.isfinite(misfit) or attempt == REFINEMENTS:
                break
            x = x + self.factors.solve(residual)
        return x, misfit

    def product(self, x: np.ndarray):
        return self.upper @ x + self.upper.T @ x - (self.upper.diagonal() * x.T).T

    def release(self):
        self.factors.release()
