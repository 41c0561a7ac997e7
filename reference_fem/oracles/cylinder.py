"""MacNeal and Harder's thick cylinder under pressure, nearly incompressible: elements that lock have large errors."""

import numpy as np

from reference_fem import exact
from reference_fem.elements.shapes import nodes
from reference_fem.model.loads import Traction
from reference_fem.model.material import NeoHookean
from reference_fem.model.problem import Problem
from reference_fem.oracles.base import Check, Curve, Oracle, Outcome, unknowns
from reference_fem.oracles.bodies import between, mapped, symmetry
from reference_fem.statics.equilibrium import equilibrium_path

INNER, OUTER, YOUNG = 3.0, 9.0, 1000.0
THICKNESS = 0.3
SCALE = 1e-2
"""Factor on the pressure. The oracle is linear, and strains of 2e-5 cause a deviation of that size. Smaller strains are
lost in round-off of J, which is multiplied by kappa (kappa/mu = 5000)."""
FAMILY = ((1, 2), (2, 3), (3, 4), (6, 8))
"""Cells along the radius and around the quarter circle: the last is checked, the others give the error over their
size."""


def quarter(cells: tuple[int, int]):
    """A quarter of the ring, one element thick."""

    def place(s: np.ndarray):
        radius, angle = INNER * (OUTER / INNER) ** s[0], 0.5 * np.pi * s[1]
        x = np.array([radius * np.cos(angle), radius * np.sin(angle), THICKNESS * s[2]])
        x[np.abs(x) < 1e-12] = 0.0
        return x

    return mapped((*cells, 1), place)


def press(ratio: float, cells: tuple[int, int]):
    """(problem, u_x at (INNER, 0) [m] under unit pressure) for one Poisson's ratio."""
    material = NeoHookean(0.5 * YOUNG / (1.0 + ratio), YOUNG / 3.0 / (1.0 - 2.0 * ratio))

    def push(t: float, x: np.ndarray):
        return SCALE * t * np.array([x[0], x[1], np.zeros_like(x[0])]) / np.hypot(x[0], x[1])

    # the centres of the inner facets lie on chords, inside the circle; all others lie outside it
    load = Traction(lambda x: np.hypot(x[0], x[1]) < INNER, push)
    problem = Problem(quarter(cells), material, [*symmetry()[:2], between(0.0, THICKNESS)], loads=[load])
    state, x = equilibrium_path(problem, [1.0])[0], nodes(problem.mesh)
    corner = (np.abs(x[:, 0] - INNER) < 1e-9) & (x[:, 1] < 1e-9)
    return problem, float(state.u[corner, 0].mean()) / SCALE


def measure() -> Outcome:
    """Three ratios on the finest mesh; the error of one over mesh size."""
    *family, finest = FAMILY
    checks, mesh = [], f"quarter, {finest[0]} x {finest[1]} cells, P2/P1"
    for ratio, truth in exact.THICK_CYLINDER.items():
        problem, moved = press(ratio, finest)
        checks.append(Check(f"u_x at (a, 0), nu {ratio:g}", "m", truth, moved, 5e-3, mesh, unknowns(problem)))
    # the published numbers have five digits, fewer than the finest of these meshes
    truth = exact.thick_cylinder_displacement(0.49)
    errors = tuple(abs(press(0.49, cells)[1] / truth - 1.0) for cells in family)
    sizes = tuple(1.0 / cells[0] for cells in family)
    return Outcome(tuple(checks), (Curve("oracles: error of the main quantity", "thick cylinder, u", sizes, errors),))


ORACLE = Oracle("cylinder", "Thick cylinder under pressure, nearly incompressible", "MacNeal and Harder 1985", measure)
