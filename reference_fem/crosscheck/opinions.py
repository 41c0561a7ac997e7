"""Oracles that compare the solutions of NGSolve and reference_fem."""

from collections.abc import Callable
from importlib.metadata import version

import numpy as np

from reference_fem.crosscheck.cases import STEPS, clamped_ball, thick_sphere
from reference_fem.crosscheck.ngsolve_code import solve
from reference_fem.model.problem import Problem
from reference_fem.oracles.base import Check, Oracle, Outcome, unknowns
from reference_fem.statics.equilibrium import equilibrium_path
from reference_fem.system.state import NewtonSettings

CLOSE = NewtonSettings(force_tol=1e-10, volume_tol=1e-12)
"""Tight tolerances, so that differences are due to the codes and not to where their iterations stop."""

AGREEMENT = 1e-8
"""Two codes with the same quadrature points solve the same equations: they differ only by Newton's tolerance, 1e-9, and
round-off. Other points would change the force by 4e-6 to 6e-3."""


def opinion(problem: Problem, what: str) -> tuple[Check, ...]:
    """Force of the first held region, displacement and pressure of both codes at the end of STEPS."""
    ours, theirs = equilibrium_path(problem, STEPS, CLOSE)[-1], solve(problem, STEPS)
    place = f"{what}, {problem.mesh.nelements:,} straight elements, order {problem.degree} in both"
    count = unknowns(problem)
    force, our_force = (float(np.linalg.norm(solution.held_force[0])) for solution in (theirs, ours))
    size, our_size = (float(np.sqrt(np.mean(solution.u**2))) for solution in (theirs, ours))
    apart = float(np.abs(theirs.u - ours.u).max() / np.abs(theirs.u).max())
    pressure = float(np.abs(theirs.p - ours.p).max() / np.abs(theirs.p).max())
    return (
        Check("force", "N", force, our_force, AGREEMENT, place, count),
        Check("rms displacement", "m", size, our_size, AGREEMENT, place, count),
        Check("largest difference of displacements over the largest", "1", 0.0, apart, AGREEMENT, place, count, True),
        Check("largest difference of pressures over the largest", "1", 0.0, pressure, AGREEMENT, place, count, True),
    )


def oracle(name: str, title: str, build: Callable[[], Problem], fast: bool = False) -> Oracle:
    """An oracle that solves the problem in both codes when it is measured."""
    source = f"NGSolve {version('ngsolve')}, same mesh, same quadrature points"
    return Oracle(name, title, source, lambda: Outcome(opinion(build(), title)), fast)


def opinions(organ: Callable[[], Problem], cut: Callable[[], Problem]) -> tuple[Oracle, ...]:
    """The four oracles; `organ` and `cut` build the problems of the last two, since this package cannot make their
    meshes."""
    return (
        oracle("second_ball", "ball with clamped caps, second code", clamped_ball),
        oracle("second_sphere", "thick sphere, second code", thick_sphere),
        oracle("second_organ", "organ pulled by a patch, second code", organ),
        oracle("second_cut", "ball that is cut open, second code", cut),
    )
