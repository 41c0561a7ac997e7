"""The sparse solver: both backends, refusal of singular matrices, one warning."""

import builtins
import importlib.util
import os
import subprocess
import sys

import numpy as np
import pytest
import scipy.sparse as sp

from reference_fem import (
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    SlowSolverWarning,
    SolveError,
    equilibrium_path,
)
from reference_fem.system import linear
from tests.reference_fem.bodies import block, symmetry

BACKENDS = ["scipy"] + (["pardiso"] if importlib.util.find_spec("pypardiso") else [])


def saddle_matrix(n=40, seed=0, least=1e-6):
    """Symmetric indefinite, with a tiny lower-right block like that of a nearly incompressible solid."""
    rng = np.random.default_rng(seed)
    B = rng.standard_normal((n // 4, n))
    K = rng.standard_normal((n, n))
    return np.block([[K @ K.T + n * np.eye(n), B.T], [B, -least * np.eye(n // 4)]])


def pulled():
    return [PrescribedDisplacement(lambda x: x[2] > 1 - 1e-9, (0, 1, 2), lambda t: (0.0, 0.1 * t, -0.2 * t))]


def upper(matrix):
    return sp.csr_matrix(np.triu(matrix))


@pytest.mark.parametrize("backend", BACKENDS)
def test_solution_solves_the_whole_symmetric_system(backend):
    solver = linear.SymmetricSolver(backend)
    for seed in (0, 1):  # the second matrix reuses the analysis of the first
        A = saddle_matrix(seed=seed)
        b = np.arange(len(A), dtype=float)
        solver.factor(upper(A))
        assert np.abs(A @ solver.solve(b) - b).max() <= linear.RESIDUAL_LIMIT * b.max()
    solver.release()


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_unchecked_solve_gives_the_same_bits_and_asks_no_residual(backend, monkeypatch):
    solver, A = linear.SymmetricSolver(backend), saddle_matrix()
    solver.factor(upper(A))
    b = np.random.default_rng(5).standard_normal((len(A), 3))
    x = solver.solve(b)
    monkeypatch.setattr(solver, "product", lambda x: pytest.fail("a residual was computed"))
    assert np.array_equal(solver.solve(b, checked=False), x)
    solver.release()


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_singular_matrix_is_refused(backend):
    A = saddle_matrix()
    A[3, :] = A[2, :]
    A[:, 3] = A[:, 2]
    A[2, 2] = A[2, 3] = A[3, 2] = A[3, 3]
    solver = linear.SymmetricSolver(backend)
    with pytest.raises(SolveError, match="free to move"):
        solver.factor(upper(A))
        solver.solve(np.arange(len(A), dtype=float))
    solver.release()


def test_a_stale_factorisation_is_noticed():
    """The check of every answer by its residual: factors of another matrix do not pass."""
    solver = linear.SymmetricSolver("scipy")
    solver.factor(upper(saddle_matrix()))
    solver.upper = upper(saddle_matrix(seed=1))
    assert not solver.refined(np.arange(50, dtype=float))[1] <= linear.RESIDUAL_LIMIT


def single_solver(monkeypatch):
    monkeypatch.setattr(linear, "SINGLE_FROM", 10)
    return linear.SymmetricSolver("pardiso")


@pytest.mark.skipif(len(BACKENDS) == 1, reason="pypardiso is not installed")
def test_single_precision_is_refined_to_the_same_limit(monkeypatch):
    """Without refinement single precision misses the limit (the mutant: no refinement)."""
    solver, rng = single_solver(monkeypatch), np.random.default_rng(5)
    Q = np.linalg.qr(rng.standard_normal((60, 60)))[0]
    A, b = Q @ np.diag(np.logspace(0, -4, 60)) @ Q.T, rng.standard_normal((60, 2))
    solver.factor(upper(A))
    assert solver.factors.single
    assert np.abs(A @ solver.factors.solve(b) - b).max() > linear.RESIDUAL_LIMIT * np.abs(b).max()
    assert np.abs(A @ solver.solve(b) - b).max() <= linear.RESIDUAL_LIMIT * np.abs(b).max()
    assert solver.factors.single
    solver.release()


@pytest.mark.skipif(len(BACKENDS) == 1, reason="pypardiso is not installed")
def test_what_single_precision_cannot_solve_is_factorised_in_double(monkeypatch):
    """A condition number of 1e9: refinement diverges. Later matrices stay in double precision."""
    solver = single_solver(monkeypatch)
    rng = np.random.default_rng(3)
    Q = np.linalg.qr(rng.standard_normal((60, 60)))[0]
    A, b = Q @ np.diag(np.logspace(0, -9, 60)) @ Q.T, rng.standard_normal(60)
    solver.factor(upper(A))
    assert solver.factors.single
    assert np.abs(A @ solver.solve(b) - b).max() <= linear.RESIDUAL_LIMIT * np.abs(b).max()
    assert not solver.factors.single
    solver.factor(upper(A + np.eye(60)))
    assert not solver.factors.single
    solver.release()


@pytest.mark.skipif(len(BACKENDS) == 1, reason="pypardiso is not installed")
def test_unknowns_in_other_units_need_no_choice_of_pivots(monkeypatch):
    """Pressures in units in which their entries are 1e-18 of the others (the mutant: no scaling)."""
    solver, units = single_solver(monkeypatch), np.where(np.arange(50) < 40, 1.0, 1e-9)
    K, b = saddle_matrix(least=1.0), np.random.default_rng(5).standard_normal(50)
    solver.factor(upper(units[:, None] * K * units))
    assert np.abs(K @ (units * solver.solve(units * b)) - b).max() <= 1e-5
    assert solver.factors.single
    solver.release()


@pytest.mark.skipif(len(BACKENDS) == 1, reason="pypardiso is not installed")
def test_both_backends_give_the_same_equilibrium():
    problem = Problem(block(skew=0.1), NeoHookean(1.0, 1000.0), [symmetry()[2], *pulled()])
    states = [equilibrium_path(problem, [1.0], NewtonSettings(solver=backend))[0] for backend in BACKENDS]
    np.testing.assert_allclose(states[0].u, states[1].u, atol=1e-9)
    np.testing.assert_allclose(states[0].held_force, states[1].held_force, atol=1e-7)


@pytest.mark.parametrize("error", [ImportError("not here"), OSError("libmkl_rt.so.3: file too short")])
def test_missing_fast_solver_is_mentioned_once(monkeypatch, error):
    usual = builtins.__import__

    def without_pardiso(name, *args, **kwargs):
        if name == "pypardiso":
            raise error
        return usual(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without_pardiso)
    linear.load_pardiso.cache_clear()
    try:
        with pytest.warns(SlowSolverWarning, match="pypardiso") as records:
            assert isinstance(linear.SymmetricSolver().factors, linear.ScipyFactors)
            linear.SymmetricSolver()
        assert len(records) == 1
        with pytest.raises(SolveError, match="use 'auto'"):
            linear.SymmetricSolver("pardiso")
    finally:
        linear.load_pardiso.cache_clear()


@pytest.mark.skipif(len(BACKENDS) == 1, reason="pypardiso is not installed")
def test_the_fast_solver_is_loaded_without_a_search():
    """In a process of its own, in which it is loaded for the first time."""
    searched = "import glob; glob.glob = None\nfrom reference_fem.system import linear\nassert linear.load_pardiso().ps"
    environment = {name: value for name, value in os.environ.items() if name != "PYPARDISO_MKL_RT"}
    subprocess.run([sys.executable, "-c", searched], check=True, env=environment)


@pytest.mark.skipif(len(BACKENDS) == 1, reason="pypardiso is not installed")
def test_factors_that_do_not_fit_are_refused_before_they_are_made(monkeypatch):
    """A cube of 3,000 unknowns on a machine with 3 MB left; the factors of its tangent take some 10 MB."""
    monkeypatch.setattr(linear, "free_bytes", lambda: 3_000_000)
    problem = Problem(block((5, 5, 5)), NeoHookean(1.0, 1000.0), [PrescribedDisplacement(lambda x: x[2] < 1e-9)])
    with pytest.raises(SolveError, match=r"unknowns needs 0\.0\d+ GB of memory and 0\.003 GB are free"):
        equilibrium_path(problem, [1.0])


@pytest.mark.skipif(len(BACKENDS) == 1, reason="pypardiso is not installed")
def test_the_estimate_of_memory_is_that_of_the_factors():
    """A full matrix of n unknowns has n (n + 1) / 2 numbers of 8 bytes in its factors; the matrix itself, its
    indices and workspace make it seven times as much. Twice the unknowns take nearly four times as much."""
    needed = []
    for n in (480, 960):
        solver = linear.SymmetricSolver("pardiso")
        A = saddle_matrix(n)
        solver.factor(upper(A))
        needed.append(solver.factors.needed_bytes())
        assert 1.0 < needed[-1] / (4 * len(A) * (len(A) + 1)) < 10.0
        solver.release()
    assert 3.0 < needed[1] / needed[0] < 4.5


def test_free_memory_is_less_than_there_is():
    assert 0 < linear.free_bytes() < 1e14
