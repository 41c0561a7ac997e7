"""Dependence of results on kappa/mu: the difference from the incompressible result is of order mu/kappa."""

import numpy as np

from reference_fem import exact
from reference_fem.model.cavity import Cavity
from reference_fem.model.material import NeoHookean
from reference_fem.model.problem import Problem
from reference_fem.oracles.ball import squeeze, whole_force
from reference_fem.oracles.base import Check, Oracle, Outcome, unknowns
from reference_fem.oracles.bodies import ball_octant, shell_octant, symmetry
from reference_fem.statics.equilibrium import equilibrium_path
from reference_fem.system.saddle_point import NewtonSettings

RATIOS = (10.0, 1e2, 1e3, 1e4, 1e5)
STRETCH, SHARE = 1.5, 0.20
SHELL, BALL = (5, 3), 5
"""Meshes, the same for every ratio, so that their discretisation error cancels."""


def sphere_pressure(ratio: float) -> tuple[Problem, float]:
    """Lumen pressure [mu] of the thick sphere at STRETCH."""
    lumen = Cavity(lambda x: np.linalg.norm(x, axis=0) < 0.75, volume=lambda t: t**3)
    problem = Problem(shell_octant(0.5, *SHELL), NeoHookean(1.0, ratio), symmetry(), cavities=[lumen])
    path = equilibrium_path(problem, (1.25, STRETCH), NewtonSettings(start=1.0))
    return problem, float(path[-1].cavity_pressure[0])


def dependence() -> dict[str, np.ndarray]:
    """Quantity -> its value at RATIOS."""
    squeezed = [squeeze(ball_octant(BALL), (0.5 * SHARE, SHARE), ratio)[1][-1] for ratio in RATIOS]
    return {
        f"thick sphere: pressure at stretch {STRETCH:g}": np.array([sphere_pressure(ratio)[1] for ratio in RATIOS]),
        f"squeezed ball: force at {100 * SHARE:.0f} %": np.array([whole_force(state) for state in squeezed]),
        f"squeezed ball: V/V0 at {100 * SHARE:.0f} %": np.array([s.volume / s.volume0 for s in squeezed]),
    }


def measure() -> Outcome:
    """The order of convergence in mu/kappa, and the difference left at the largest ratio."""
    spheres = {ratio: sphere_pressure(ratio) for ratio in RATIOS}
    problem, last = spheres[RATIOS[-1]]
    change = [abs(spheres[ratio][1] / last - 1.0) for ratio in (1e2, 1e3)]
    about = (f"octant, {SHELL[0]} columns x {SHELL[1]} layers", unknowns(problem))
    # second order in mu/kappa: a few hundredths at 1e2
    order = Check(
        "order of approach in mu/kappa", "1", 1.0, float(np.log10(change[0] / change[1])), 0.05, *about, absolute=True
    )
    truth = exact.thick_sphere_pressure(1.0, 0.5, 1.0, STRETCH)
    # this coarse mesh leaves 0.2 %
    return Outcome((order, Check(f"lumen pressure, kappa/mu {RATIOS[-1]:g}", "mu", truth, last, 5e-3, *about)))


ORACLE = Oracle("kappa", "Thick sphere from kappa/mu = 10 to 1e5", "closed form; Taylor expansion in mu/kappa", measure)
