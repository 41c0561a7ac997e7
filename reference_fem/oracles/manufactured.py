"""Manufactured solution: a smooth motion, the body force that it needs, and the order of convergence.

Three shears and a stretch, phi = S∘C∘B∘A: A adds a sin(pi Y / 2) to x, B adds b sin(pi z) to y, C adds c sin(pi x / 2)
to z, all of unit determinant, and S multiplies z by 1 + q(x, y) / kappa. So J = 1 + q / kappa, and the pressure is q.
"""

from collections.abc import Callable

import numpy as np
from skfem import ElementTetP1, ElementTetP2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from reference_fem.elements.shapes import basis_table, element_nodes, nodes
from reference_fem.model.loads import BodyForce
from reference_fem.model.material import Material, MooneyRivlin
from reference_fem.model.problem import PrescribedDisplacement, Problem
from reference_fem.oracles.base import Check, Curve, Oracle, Outcome, unknowns
from reference_fem.oracles.bodies import block
from reference_fem.statics.equilibrium import equilibrium_path

SHEARS, PRESSURE = (0.15, 0.10, 0.12), 2.0
"""a, b, c [m] and the largest pressure over the shear modulus."""
MATERIAL = MooneyRivlin(0.3, 0.2, 1000.0)
CELLS = (4, 6, 8)
"""Cells along each edge of the cube; six tetrahedra per cell."""


def motion(X: np.ndarray, kappa: float):
    """Positions (3, …), deformation gradient (…, 3, 3) and pressure (…) of the motion at rest positions X (3, …)."""
    a, b, c = SHEARS
    half = np.pi / 2.0
    x, y, z = np.asarray(X, dtype=float)
    F = np.broadcast_to(np.eye(3), (*x.shape, 3, 3)).copy()
    F[..., 0, :] += (a * half * np.cos(half * y))[..., None] * F[..., 1, :]
    x = x + a * np.sin(half * y)
    F[..., 1, :] += (b * np.pi * np.cos(np.pi * z))[..., None] * F[..., 2, :]
    y = y + b * np.sin(np.pi * z)
    F[..., 2, :] += (c * half * np.cos(half * x))[..., None] * F[..., 0, :]
    z = z + c * np.sin(half * x)
    q = PRESSURE * np.sin(half * x) * np.cos(half * y)
    slope = half * PRESSURE * np.stack((np.cos(half * x) * np.cos(half * y), -np.sin(half * x) * np.sin(half * y)), -1)
    change = slope[..., :1] * F[..., 0, :] + slope[..., 1:] * F[..., 1, :]
    F[..., 2, :] = (1.0 + q / kappa)[..., None] * F[..., 2, :] + (z / kappa)[..., None] * change
    return np.stack((x, y, z * (1.0 + q / kappa))), F, q


def body_force(material: Material) -> Callable:
    """-Div P of the motion, times t: central differences of fourth order, whose error here is about 1e-11."""
    step = 1e-3

    def stress(X: np.ndarray):
        _, F, q = motion(X, material.kappa)
        return material.stress(F, q)

    def value(t: float, X: np.ndarray):
        force = np.zeros_like(X)
        for axis, e in enumerate(step * np.eye(3)[:, :, None]):
            slope = 8.0 * (stress(X + e) - stress(X - e)) - (stress(X + 2.0 * e) - stress(X - 2.0 * e))
            force -= slope[..., axis].T / (12.0 * step)
        return t * force

    return value


def build(cells: int, material: Material = MATERIAL) -> Problem:
    """The cube under the body force, with its whole boundary moved as in the motion."""

    def displacement(x: np.ndarray):
        return motion(x, material.kappa)[0] - x

    held = PrescribedDisplacement(lambda x: np.ones(x.shape[1], bool), (0, 1, 2), lambda t: (t, t, t), displacement)
    return Problem(block((cells,) * 3), material, [held], loads=[BodyForce(body_force(material))])


def relative_errors(problem: Problem):
    """Relative L2 errors of displacement and pressure, integrated like the problem itself."""
    state, mesh = equilibrium_path(problem, (0.5, 1.0))[-1], problem.mesh
    points, _ = get_quadrature(RefTet, problem.order)
    quadratic, _ = basis_table(ElementTetP2(), points)
    linear, _ = basis_table(ElementTetP1(), points)
    table = element_nodes(mesh)
    X, u = (np.einsum("qn,eni->ieq", quadratic, field[table]) for field in (nodes(mesh), state.u))
    p = state.p[mesh.t[:4].T] @ linear.T
    moved, _, q = motion(X, problem.material.kappa)
    w = state.weights
    return l2(u - (moved - X), w) / l2(moved - X, w), l2(p - q, w) / l2(q, w)


def l2(field: np.ndarray, weights: np.ndarray):
    """Root of the integral of |field|²."""
    return float(np.sqrt(np.sum(weights * np.square(field))))


def measure() -> Outcome:
    problems = [build(cells) for cells in CELLS]
    errors = np.array([relative_errors(problem) for problem in problems])
    sizes, about = tuple(1.0 / cells for cells in CELLS), f"cube, {problems[-1].mesh.nelements} P2/P1"
    checks, curves = [], []
    for k, (name, rate) in enumerate((("displacement", 3.0), ("pressure", 2.0))):
        curve = Curve(f"manufactured solution: {name}", "P2/P1", sizes, tuple(map(float, errors[:, k])))
        curves.append(curve)
        # 0.15: between these meshes the orders still change by 0.1
        quantity = f"order of the error of the {name}"
        checks.append(Check(quantity, "1", rate, curve.order, 0.15, about, unknowns(problems[-1]), absolute=True))
    return Outcome(tuple(checks), tuple(curves))


ORACLE = Oracle("manufactured", "Manufactured solution: orders of convergence", "closed form", measure)
