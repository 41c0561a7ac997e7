"""A ball squeezed between two frictionless planes, reduced to an eighth by symmetry."""

from collections.abc import Sequence

import numpy as np
from skfem import MeshTet

from reference_fem import exact
from reference_fem.elements.shapes import nodes
from reference_fem.model.material import NeoHookean
from reference_fem.model.obstacles import RigidPlane
from reference_fem.model.problem import Problem
from reference_fem.oracles.base import Check, Curve, Oracle, Outcome, unknowns
from reference_fem.oracles.bodies import ball_octant, symmetry
from reference_fem.statics.equilibrium import Equilibrium, equilibrium_path

KAPPA = 5000.0
"""Bulk modulus over mu."""
JUDGED = (0.10, 0.15, 0.20, 0.25, 0.30, 0.35)
"""Approaches of the planes, over the diameter, that are checked; the path starts at half the first."""
FAMILY = (5, 7, 10)
"""Elements per quarter circle."""
GRADE, RADIAL = 0.35, 0.5
"""Finer at the pole and towards the surface: see ball_octant."""


def squeeze(mesh: MeshTet, shares: Sequence[float], kappa: float = KAPPA) -> tuple[Problem, list[Equilibrium]]:
    """(problem, equilibria) of an octant of unit radius and modulus, at approaches `shares` over the diameter."""
    plane = RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), lambda t: (0.0, 0.0, -t))
    problem = Problem(mesh, NeoHookean(1.0, kappa), symmetry(), [plane])
    return problem, equilibrium_path(problem, shares)


def whole_force(state: Equilibrium) -> float:
    """Force of one plane on the whole ball [mu R²]: it touches four octants."""
    return -4.0 * float(state.obstacle_force[0, 2])


def measure() -> Outcome:
    """Force, equator radius and volume on the finest mesh; error of the force at an approach of 0.30 over mesh size."""
    checks, errors = [], []
    for cells in FAMILY:
        mesh = ball_octant(cells, GRADE, RADIAL)
        problem, path = squeeze(mesh, (0.05, *JUDGED))
        by_share = {state.t: state for state in path}
        errors.append(abs(whole_force(by_share[0.30]) / exact.BALL_BETWEEN_PLANES[0.30][0] - 1.0))
    x, about = nodes(mesh), (f"octant, {mesh.nelements} elements", unknowns(problem))
    for share in JUDGED:
        state, (force, equator) = by_share[share], exact.BALL_BETWEEN_PLANES[share]
        radius = float((x + state.u)[np.argmax(x[:, 0]), 0])
        checks.append(Check(f"force, d {share:.2f}", "mu R²", force, whole_force(state), 5e-3, *about))
        checks.append(Check(f"equator, d {share:.2f}", "R", equator, radius, 5e-4, *about))
    ratio = path[-1].volume / path[-1].volume0
    checks.append(Check(f"V/V0, d {JUDGED[-1]:.2f}", "1", 1.0, float(ratio), 1e-4, *about))
    sizes = tuple(1.0 / cells for cells in FAMILY)
    curve = Curve("oracles: error of the main quantity", "squeezed ball, force", sizes, tuple(errors))
    return Outcome(tuple(checks), (curve,))


ORACLE = Oracle(
    "ball_between_planes",
    "Ball between frictionless planes",
    "axisymmetric P2/P1 solution, two meshes within 1e-4",
    measure,
    fast=False,
)


SMALL = (0.01, 0.02)
"""Approaches over the diameter. Finite strain adds a term that is about linear in the approach (3 % at 0.01, 5 % at
0.02)."""
TOUCH = 10, 0.1, 0.8
"""Elements at the pole are a hundredth of the radius: eight or more per contact radius of 0.1."""


def measure_touch() -> Outcome:
    """Force over that of Hertz at two approaches, extrapolated linearly to approach 0."""
    mesh = ball_octant(*TOUCH)
    problem, path = squeeze(mesh, SMALL)
    ratios = [whole_force(state) / exact.hertz_plane_force(1.0, 1.0, state.t) for state in path]
    limit = ratios[0] - (ratios[1] - ratios[0]) * SMALL[0] / (SMALL[1] - SMALL[0])
    mesh_name = f"octant, {mesh.nelements} elements, graded to the pole"
    check = Check("force over Hertz's, d -> 0", "1", 1.0, limit, 0.02, mesh_name, unknowns(problem))
    return Outcome((check,))


TITLE = "First touch of a ball between planes"
TOUCH_ORACLE = Oracle("hertz", TITLE, "Hertz 1881, E* = 4 mu", measure_touch, fast=False)
