"""Benchmarks of the reference on this machine. The functions return numbers; the caller pins the core and prints."""

import resource
import time
from collections.abc import Callable, Sequence

import numpy as np
from skfem import MeshTet

from reference_fem.model.material import NeoHookean
from reference_fem.model.obstacles import Obstacle, RigidPlane
from reference_fem.model.problem import PrescribedDisplacement, Problem
from reference_fem.statics.equilibrium import equilibrium_path
from reference_fem.system.saddle_point import System
from reference_fem.system.state import Loads, NewtonSettings


def slab(cells: int, obstacles: Sequence[Obstacle] = ()):
    """A cube of side 1 m, mu = 1 Pa, held at the bottom; `cells` along each edge, 9 make about 9,000 unknowns."""
    ticks = np.linspace(0.0, 1.0, cells + 1)
    mesh = MeshTet.init_tensor(ticks, ticks, ticks)
    return Problem(mesh, NeoHookean(1.0, 5000.0), [PrescribedDisplacement(lambda x: x[2] < 1e-9)], obstacles)


def fastest(action: Callable[[], object], repeats: int):
    """Least wall time [s] of an action, after one call that warms up."""
    action()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return min(times)


def iteration_costs(cells: int = 7, repeats: int = 7, solver: str = "auto"):
    """Cost of one Newton iteration: unknowns, assembly_s, factor_s, solve_s, iteration_s, assembled_per_s [1/s]."""
    system = System(slab(cells), NewtonSettings(solver=solver))
    x = 1e-4 * np.random.default_rng(0).standard_normal(system.total)
    x[system.pattern.held] = 0.0
    loads = Loads(0.0, system.rows, system.rest().multiplier)
    evaluation = system.evaluate(x, loads)
    upper, right = system.pattern.upper(evaluation.values), -evaluation.residual[system.pattern.free]
    assembly = fastest(lambda: system.evaluate(x, loads), repeats)
    factor = fastest(lambda: system.solver.factor(upper), repeats)
    solve = fastest(lambda: system.solver.solve(right), repeats)
    system.solver.release()
    return {
        "unknowns": int(system.total),
        "assembly_s": assembly,
        "factor_s": factor,
        "solve_s": solve,
        "iteration_s": assembly + factor + solve,
        "assembled_per_s": int(system.total) / assembly,
    }


def contact_path(cells: int = 9, steps: int = 10, solver: str = "auto"):
    """A tilted plane pressed into the cube in equal steps: unknowns, wall_s, peak_bytes of the process so far,
    iterations (list, one per step)."""
    plane = RigidPlane((1.0, 0.5, 1.0), (-0.2, 0.0, -1.0), lambda t: (0.0, 0.0, -0.2 * t))
    problem = slab(cells, [plane])
    start = time.perf_counter()
    path = equilibrium_path(problem, np.arange(1, steps + 1) / steps, NewtonSettings(solver=solver))
    return {
        "unknowns": path[0].u.size + path[0].p.size,
        "wall_s": time.perf_counter() - start,
        "peak_bytes": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
        "iterations": [state.newton_iterations for state in path],
    }
