"""Vibrations of a free ball: its torsional and spheroidal modes of order two."""

import numpy as np

from reference_fem import exact
from reference_fem.dynamics.modes import natural_frequencies
from reference_fem.model.material import NeoHookean
from reference_fem.model.problem import Problem
from reference_fem.oracles.base import Check, Curve, Oracle, Outcome, unknowns
from reference_fem.oracles.bodies import whole_ball

RATIOS = {5000.0: 0.5, 5.0 / 3.0: 0.25}
"""kappa/mu -> Poisson's ratio; 5000 is 0.4999, and changes the frequency by less than 1e-4."""
FAMILY = (2, 3)
"""Elements per quarter circle."""


def ring(cells: int, kappa: float):
    """(problem, omega R / sqrt(mu/rho) of the ten lowest modes) of a ball of unit radius, modulus and density."""
    problem = Problem(whole_ball(cells), NeoHookean(1.0, kappa), (), density=1.0)
    return problem, natural_frequencies(problem, 10).elastic


def measure() -> Outcome:
    """Both families of five modes for both materials; error of the torsional ones over mesh size."""
    checks, errors = [], []
    for kappa, ratio in RATIOS.items():
        problem, omega = ring(FAMILY[-1], kappa)
        mesh = f"whole ball, {problem.mesh.nelements} elements"
        for what, truth, modes in (
            ("torsional", exact.ball_torsional(), omega[:5]),
            ("spheroidal", exact.ball_spheroidal(ratio), omega[5:]),
        ):
            worst = float(modes[np.argmax(np.abs(modes - truth))])
            quantity = f"omega R/sqrt(mu/rho), {what} n = 2, nu {ratio:g}"
            checks.append(Check(quantity, "1", truth, worst, 5e-3, mesh, unknowns(problem)))
    for cells in FAMILY:
        _, omega = ring(cells, max(RATIOS))
        errors.append(float(np.abs(omega[:5] / exact.ball_torsional() - 1.0).max()))
    sizes = tuple(1.0 / cells for cells in FAMILY)
    curve = Curve("oracles: error of the main quantity", "ringing ball, frequency", sizes, tuple(errors))
    return Outcome(tuple(checks), (curve,))


ORACLE = Oracle("ringing", "Ringing ball, free", "Lamb 1882", measure)
