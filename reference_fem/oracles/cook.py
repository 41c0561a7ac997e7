"""Cook's membrane at finite strain, incompressible, in plane strain."""

import numpy as np

from reference_fem import exact
from reference_fem.elements.shapes import nodes
from reference_fem.model.loads import Traction
from reference_fem.model.material import NeoHookean
from reference_fem.model.problem import PrescribedDisplacement, Problem
from reference_fem.oracles.base import Check, Curve, Oracle, Outcome, unknowns
from reference_fem.oracles.bodies import between, mapped
from reference_fem.statics.equilibrium import equilibrium_path

LEFT, LOWER, UPPER, RIGHT = 44.0, 44.0, 60.0, 48.0
"""Height of the held edge, the loaded edge from LOWER to UPPER at x = RIGHT [mm]."""
MU, FORCE = 80.1938, 100.0
"""[MPa], and [N] for each mm of thickness."""
KAPPA = 1e5
"""Bulk modulus over MU; the truth is incompressible."""
FAMILY = (4, 8, 16)
TOWARDS_WALL, TOWARDS_CORNERS = 1.6, 0.8
"""Grading: the stress is singular at both ends of the held edge, where even cells converge with order one."""


def membrane(cells: int):
    """(mesh, thickness [mm]) of the membrane, one element thick."""
    thickness = LEFT / cells

    def place(s: np.ndarray):
        across = s[0] ** TOWARDS_WALL
        up = s[1] + TOWARDS_CORNERS * (s[1] ** 2 * (3.0 - 2.0 * s[1]) - s[1])
        height = LEFT - (LEFT + LOWER - UPPER) * across
        return np.array([RIGHT * across, LOWER * across + up * height, thickness * s[2]])

    return mapped((cells, cells, 1), place), thickness


def bend(cells: int):
    """(problem, {quantity: displacement [mm]}) under the whole force."""
    mesh, thickness = membrane(cells)
    shear = FORCE / (UPPER - LOWER)

    def push(t: float, x: np.ndarray):
        return np.array([np.zeros_like(x[0]), np.full_like(x[0], shear * t), np.zeros_like(x[0])])

    held = [PrescribedDisplacement(lambda x: x[0] < 1e-9), between(0.0, thickness)]
    load = Traction(lambda x: x[0] > RIGHT - 1e-9, push)
    problem = Problem(mesh, NeoHookean(MU, KAPPA * MU), held, loads=[load])
    state, x = equilibrium_path(problem, (0.25, 0.5, 0.75, 1.0))[-1], nodes(mesh)

    def mean(height: float, axis: int):
        there = (np.abs(x[:, 0] - RIGHT) < 1e-6) & (np.abs(x[:, 1] - height) < 1e-6)
        return float(state.u[there, axis].mean())

    middle = 0.5 * (LOWER + UPPER)
    return problem, {"corner u_x": mean(UPPER, 0), "corner u_y": mean(UPPER, 1), "mid-edge u_y": mean(middle, 1)}


def measure() -> Outcome:
    """Three displacements on the finest mesh; error at the corner over mesh size."""
    bends = [bend(cells) for cells in FAMILY]
    problem, last = bends[-1]
    mesh = f"slab, {FAMILY[-1]} x {FAMILY[-1]} cells, graded"
    checks = [
        Check(f"{what}", "mm", truth, last[what], 5e-3, mesh, unknowns(problem)) for what, truth in exact.COOK.items()
    ]
    errors = tuple(abs(values["corner u_y"] / exact.COOK["corner u_y"] - 1.0) for _, values in bends)
    sizes = tuple(1.0 / cells for cells in FAMILY)
    curve = Curve("oracles: error of the main quantity", "Cook's membrane, corner u_y", sizes, errors)
    return Outcome(tuple(checks), (curve,))


ORACLE = Oracle("cook", "Cook's membrane, finite strain", "mesh-converged plane-strain solution", measure)
