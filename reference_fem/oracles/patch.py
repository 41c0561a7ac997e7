"""A body whose whole boundary moves affinely is affine inside, at constant pressure, on any mesh."""

import numpy as np

from reference_fem.elements.shapes import nodes
from reference_fem.model.material import MooneyRivlin
from reference_fem.model.problem import PrescribedDisplacement, Problem
from reference_fem.oracles.base import Check, Oracle, Outcome, unknowns
from reference_fem.oracles.bodies import block
from reference_fem.oracles.uniaxial import TIGHT
from reference_fem.statics.equilibrium import equilibrium_path

STRAIN = 5e-4
"""Volume change, so that the pressure is not zero."""
RATIOS = (10.0, 1e3, 1e5)


def affine():
    """A shear and stretch with det F = 1 + STRAIN, (3, 3)."""
    F = np.array([[1.1, 0.2, 0.0], [0.0, 0.95, 0.1], [0.05, 0.0, 0.98]])
    return F * ((1.0 + STRAIN) / np.linalg.det(F)) ** (1.0 / 3.0)


def measure() -> Outcome:
    """Largest error of displacement and pressure, from kappa/mu = 10 to 1e5."""
    mesh, checks = block(skew=0.1), []
    x, F = nodes(mesh), affine()
    shape = lambda x: (F - np.eye(3)) @ x  # noqa: E731
    held = [PrescribedDisplacement(lambda x: np.ones(x.shape[1], bool), (0, 1, 2), lambda t: (t, t, t), shape)]
    for ratio in RATIOS:
        problem = Problem(mesh, MooneyRivlin(0.3, 0.2, ratio), held)
        state = equilibrium_path(problem, [1.0], TIGHT)[0]
        misfit = float(np.abs(state.u - x @ (F - np.eye(3)).T).max())
        about = (f"block, {mesh.nelements} P2/P1", unknowns(problem))
        checks.append(Check(f"worst u error, kappa/mu {ratio:g}", "m", 0.0, misfit, 1e-8, *about, absolute=True))
        worst = float(state.p[np.argmax(np.abs(state.p - ratio * STRAIN))])
        checks.append(Check(f"worst pressure, kappa/mu {ratio:g}", "mu", ratio * STRAIN, worst, 1e-8, *about))
    return Outcome(tuple(checks))


ORACLE = Oracle("patch", "Patch test: affine boundary, constant pressure", "closed form", measure)
