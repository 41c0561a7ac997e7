"""Time of a Newton iteration here and in NGSolve, on the same problem and mesh; the caller pins the core and prints."""

import time
from collections.abc import Callable

import numpy as np

from reference_fem.crosscheck.cases import clamped_ball
from reference_fem.crosscheck.ngsolve_code import NgsolveModel
from reference_fem.model.problem import Problem
from reference_fem.oracles.base import unknowns
from reference_fem.statics.tangent import Tangent
from reference_fem.system.saddle_point import System
from reference_fem.system.state import NewtonSettings

INVERSES = ("sparsecholesky", "umfpack")
"""The direct solvers of NGSolve. Its interface to MKL, if present, was not faster."""

FIRST = 0.02
"""Time of the state at which both codes iterate: slightly deformed, as within a loading path."""


def iteration_ratio(n: int = 7, repeats: int = 3) -> dict:
    """Seconds of an iteration (tangent, residual, factors, solution), of reference_fem over the faster of NGSolve's.

    Both are measured in turn; each time is the least of the repeats after one warm-up. Keys: unknowns, own_s,
    ngsolve_s, ratio, inverse. Raises SolveError where the extra is missing.
    """
    problem = clamped_ball(n)
    actions = {"own": own_iteration(problem)} | {name: ngsolve_iteration(problem, name) for name in INVERSES}
    best = dict.fromkeys(actions, np.inf)
    for _ in range(repeats):
        for name, action in actions.items():
            best[name] = min(best[name], action())
    inverse = min(INVERSES, key=lambda name: best[name])
    ratio = best["own"] / best[inverse]
    names = ("unknowns", "own_s", "ngsolve_s", "ratio", "inverse")
    return dict(zip(names, (int(unknowns(problem)), best["own"], best[inverse], ratio, inverse), strict=True))


def own_iteration(problem: Problem) -> Callable[[], float]:
    """A function that makes one iteration of reference_fem and returns its time [s]; it has been called once to warm
    up."""
    system = System(problem, NewtonSettings())
    state, target = system.rest(), system.held_at(FIRST)
    loads = system.loads_of(state)
    held = system.pattern.held
    x = Tangent(system, system.evaluate(state.x, loads)).newton(target - state.x[held])

    def action():
        start = time.perf_counter()
        Tangent(system, system.evaluate(x, loads)).newton(target - x[held])
        return time.perf_counter() - start

    action()
    return action


def ngsolve_iteration(problem: Problem, inverse: str) -> Callable[[], float]:
    """The same for the Newton solver of NGSolve: half the time of two iterations."""
    model = NgsolveModel(problem)
    model.advance(FIRST, inverse)

    def action():
        start = time.perf_counter()
        model.iterate(inverse, 0.0, 2)
        return 0.5 * (time.perf_counter() - start)

    return action
