"""Manufactured solution: a smooth motion, the body force that it needs, and the order of convergence of each element.

Three shears and a stretch, phi = S∘C∘B∘A: A adds a sin(pi Y / 2) to x, B adds b sin(pi z) to y, C adds c sin(pi x / 2)
to z, all of unit determinant, and S multiplies z by 1 + q(x, y) / kappa. So J = 1 + q / kappa, and the pressure is q.
"""

from collections.abc import Callable, Iterable

import numpy as np
from skfem import ElementTetP2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from reference_fem.elements.shapes import basis_table, element_nodes, nodes
from reference_fem.elements.table import DEFAULT, ELEMENTS
from reference_fem.model.loads import BodyForce
from reference_fem.model.material import Material, MooneyRivlin
from reference_fem.model.problem import PrescribedDisplacement, Problem
from reference_fem.oracles.base import Check, Curve, Oracle, Outcome, unknowns
from reference_fem.oracles.bodies import block
from reference_fem.statics.equilibrium import advance
from reference_fem.system import assembly
from reference_fem.system.saddle_point import System
from reference_fem.system.state import NewtonSettings

SHEARS, PRESSURE = (0.15, 0.10, 0.12), 2.0
"""a, b, c [m] and the largest pressure over the shear modulus."""
MATERIAL = MooneyRivlin(0.3, 0.2, 1000.0)
CELLS = {"P2/P1": (4, 6, 8), "MINI": (4, 6, 8), "P2/P0": (4, 6, 8), "P1": (4, 6, 8)}
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


def build(name: str, cells: int, material: Material = MATERIAL) -> Problem:
    """The cube under the body force, with its whole boundary moved as in the motion."""

    def displacement(x: np.ndarray):
        return motion(x, material.kappa)[0] - x

    held = PrescribedDisplacement(lambda x: np.ones(x.shape[1], bool), (0, 1, 2), lambda t: (t, t, t), displacement)
    return Problem(block((cells,) * 3), material, [held], element=name, loads=[BodyForce(body_force(material))])


def solve(problem: Problem):
    """(system, unknowns) at t = 1."""
    system = System(problem, NewtonSettings())
    state = system.rest()
    for t in (0.5, 1.0):
        state, *_ = advance(system, state, t, 1.0, [])
    system.solver.release()
    return system, state.x


def relative_errors(problem: Problem):
    """Relative L2 errors of displacement and pressure, integrated like the problem itself."""
    system, x = solve(problem)
    points, _ = get_quadrature(RefTet, problem.degree)
    place, _ = basis_table(ElementTetP2(), points)
    functions, _ = basis_table(system.element.displacement, points)
    X = np.einsum("qn,eni->ieq", place, nodes(problem.mesh)[element_nodes(problem.mesh)])
    local = x[system.elements.dofs[:, : 3 * functions.shape[1]]].reshape(X.shape[1], 3, -1)
    u = np.einsum("qa,eia->ieq", functions, local)
    _, p = assembly.deformation(x, system.elements, problem.material.kappa)
    moved, _, q = motion(X, problem.material.kappa)
    w = system.elements.weights
    return l2(u - (moved - X), w) / l2(moved - X, w), l2(p - q, w) / l2(q, w)


def l2(field: np.ndarray, weights: np.ndarray):
    """Root of the integral of |field|²."""
    return float(np.sqrt(np.sum(weights * np.square(field))))


def curves(name: str) -> tuple[Curve, Curve]:
    """Errors of displacement and pressure of one element over mesh size."""
    errors = np.array([relative_errors(build(name, cells)) for cells in CELLS[name]])
    sizes = tuple(1.0 / cells for cells in CELLS[name])
    panels = ("manufactured solution: displacement", "manufactured solution: pressure")
    u, p = (
        Curve(panel, name, sizes, tuple(map(float, column))) for panel, column in zip(panels, errors.T, strict=True)
    )
    return u, p


def orders(names: Iterable[str]) -> Outcome:
    """Orders of some elements between their two finest meshes."""
    checks, error_curves = [], []
    for name in names:
        problem = build(name, CELLS[name][-1])
        about = (f"cube, {problem.mesh.nelements} {name}", unknowns(problem))
        pair = curves(name)
        for what, rate, curve in zip("up", ELEMENTS[name].rates, pair, strict=True):
            # 0.15: between these meshes the orders of the default still change by 0.1; those of the others need not be
            # sharp
            kind = "within" if name == DEFAULT else "at least"
            quantity = f"order of the error of {what}, {name}"
            checks.append(Check(quantity, "1", rate, curve.order, 0.15, *about, absolute=True, kind=kind))
        error_curves += pair
    return Outcome(tuple(checks), tuple(error_curves))


def others() -> Outcome:
    """All elements but the default."""
    return orders([name for name in ELEMENTS if name != DEFAULT])


TITLE = "Manufactured solution: orders of convergence"
ORACLE = Oracle("manufactured", TITLE, "closed form", lambda: orders([DEFAULT]))
OTHERS = Oracle("manufactured_others", f"{TITLE}, other elements", "closed form", others, fast=False)
