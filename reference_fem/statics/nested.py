"""Nested iteration: a solution is transferred from a mesh to a finer mesh of the same body and solved there.

Newton then starts near the solution: it takes 2 to 4 iterations and no load path, where a path from rest takes 5 to 9
per load step (docs/theory.md, section 6).
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree
from skfem import ElementTetP2, MeshTet

from reference_fem.contact.augmented import NO_GRIP
from reference_fem.elements.evaluate import Evaluator
from reference_fem.elements.shapes import basis_table, element_nodes
from reference_fem.elements.surface import point_positions
from reference_fem.errors import SolveError
from reference_fem.statics.active_set import look_at
from reference_fem.statics.newton import StepFailed, solve_step
from reference_fem.system import assembly
from reference_fem.system.saddle_point import System
from reference_fem.system.state import State

REPAIRS = 20
"""Most rounds of repairing inverted elements of a transferred field; if a repair is possible, 1 to 3 are enough."""


SMALLEST_SHARE = 1 / 64
"""Smallest part of the unbalanced forces that is removed at once."""


class Transfer(NamedTuple):
    """Positions of the n P2 nodes of a finer mesh in a coarser one."""

    corners: np.ndarray
    """Vertices of the coarse element of each node, (n, 4)."""
    linear: np.ndarray
    """Their linear shape functions at the node, (n, 4)."""
    table: np.ndarray
    """The ten P2 nodes of the element, (n, 10)."""
    quadratic: np.ndarray
    """Their quadratic shape functions at the node, (n, 10)."""

    def displacement(self, u: np.ndarray) -> np.ndarray:
        """A field at the P2 nodes of the coarser mesh (N2, c) at those of the finer one, (n, c)."""
        return np.einsum("na,nac->nc", self.quadratic, u[self.table])

    def pressure(self, p: np.ndarray, vertices: int) -> np.ndarray:
        """A field at the vertices of the coarser mesh (N1,) at the first `vertices` nodes of the finer one."""
        return np.einsum("na,na->n", self.linear[:vertices], p[self.corners[:vertices]])


def transfer(coarse: MeshTet, elements: np.ndarray, points: np.ndarray) -> Transfer:
    """Transfer to `points` (n, 3) [m], each in or next to the coarse element of `elements` (n,)."""
    local = Evaluator(coarse).invert(elements, points)
    quadratic, _ = basis_table(ElementTetP2(), local.T)
    linear = np.column_stack((1.0 - local.sum(axis=1), local))
    table = element_nodes(coarse)[elements]
    return Transfer(table[:, :4], linear, table, quadratic)


def carried(coarse: System, state: State, fine: System, to: Transfer) -> State:
    """The state of the coarser system on the finer one: displacement, pressure, cavities, contact pressures.

    A contact point gets the pressure of the nearest point of the coarser surface at rest. Raises SolveError for
    obstacles without slip, whose grip depends on the path.
    """
    if coarse.sticks.any():
        raise SolveError("an obstacle without slip holds what it met on its way: solve its path from rest")
    n, m = coarse.displacement_count, coarse.field_count
    u = to.displacement(state.x[:n].reshape(-1, 3))
    p = to.pressure(state.x[n:m], fine.problem.mesh.nvertices)
    x = np.concatenate((u.ravel(), p, state.x[m:]))
    x[fine.pattern.held] = fine.held_at(state.t)
    pressure = carried_contact(coarse, state.pressure, fine)
    faces = carried_between_faces(coarse, state.face_pressure, fine)
    carried_over = replace(state, x=x, multiplier=pressure, pressure=pressure, faces=faces, face_pressure=faces)
    return replace(carried_over, stiffness=1.0, grip=NO_GRIP, hold=NO_GRIP)


def carried_contact(coarse: System, pressure: np.ndarray, fine: System) -> np.ndarray:
    """Contact pressures (no, nf, nq) [Pa] of the coarser surface at the points of the finer one."""
    if not len(pressure):
        return np.zeros((0, *fine.surface.weights.shape))
    rest = [point_positions(np.zeros(len(s.surface.rest)), s.surface) for s in (coarse, fine)]
    near = KDTree(rest[0].reshape(-1, 3)).query(rest[1].reshape(-1, 3))[1]
    return pressure.reshape(len(pressure), -1)[:, near].reshape(len(pressure), *rest[1].shape[:2])


def multipliers(system: System, x: np.ndarray, t: float, pressure: np.ndarray) -> np.ndarray:
    """Multipliers m (no, nf, nq) [Pa] with which the points of a body at x have the contact pressure t = max(0, m -
    eps g) that is given (docs/theory.md, eq. 6.2).

    The finer surface differs slightly in position from the coarser one, and eps times this difference is up to 25 times
    the pressure. With the pressures themselves as multipliers, the first tangent is not positive definite on
    volume-preserving changes, and Newton takes 12 iterations in place of 3.
    """
    rows, penalty = system.obstacles_at(t), system.surface.penalty[:, None]
    gap, normal = np.empty_like(pressure), np.empty((*pressure.shape, 3))
    look_at(rows, point_positions(x, system.surface), gap, normal)
    return np.where(pressure > 0.0, pressure + penalty * gap, penalty * np.minimum(gap, 0.0))


def carried_between_faces(coarse: System, pressure: np.ndarray, fine: System) -> np.ndarray:
    """Pressures (nf, nq) [Pa] between the faces of the coarser cut at the points of the finer one."""
    if not pressure.size:
        return np.zeros(fine.faces.weights.shape)
    rest = []
    for faces in (coarse.faces, fine.faces):
        nodes = faces.rest[faces.dofs].reshape(len(faces.dofs), 2, 3, -1)[:, 0]
        rest.append(np.einsum("qa,fia->fqi", faces.values, nodes).reshape(-1, 3))
    near = KDTree(rest[0]).query(rest[1])[1]
    return pressure.ravel()[near].reshape(fine.faces.weights.shape)


def continued(system: System, state: State) -> State:
    """The equilibrium at the time and load of a transferred state. Raises StepFailed if Newton finds none from there.

    If one step fails, dead forces that balance the transferred state are added and then removed in small parts. This is
    needed at outlines of held regions, where the strain grows with each refinement. Under obstacles it is not tried:
    there a path from rest ends sooner.
    """
    x = repaired(system, state.x)
    multiplier = multipliers(system, x, state.t, state.pressure)
    state = replace(state, x=x, multiplier=multiplier, pressure=multiplier)
    try:
        return solve_step(system, state, state.t, state.load)
    except StepFailed:
        missing = None if len(system.rows) else unbalanced(system, state)
        if missing is None:
            raise
    left, step, iterations = 1.0, 0.5, 0
    while left > 0.0:
        goal = max(0.0, left - step)
        try:
            state = solve_step(system, state, state.t, state.load, goal * missing)
        except StepFailed:
            step *= 0.5
            if step < SMALLEST_SHARE:
                raise
            continue
        iterations, left = iterations + state.iterations, goal
    return replace(state, iterations=iterations)


def unbalanced(system: System, state: State) -> np.ndarray | None:
    """The dead forces (field_count,) with which a state would be in equilibrium; None if an element is inverted."""
    loads = system.loads_of(state)
    evaluation = system.evaluate(state.x, loads, tangent=False)
    if not evaluation.usable:
        return None
    missing = evaluation.residual[: system.field_count].copy()
    missing[system.pattern.held] = 0.0
    return missing


def repaired(system: System, x: np.ndarray) -> np.ndarray:
    """Unknowns (total,) with inverted elements repaired where a simple change is enough.

    The mid-side nodes of an element that is inverted at a quadrature point are displaced as the mean of their vertices;
    if that is not enough, its displacements are averaged with those of its neighbours. Held unknowns do not change.
    """
    table, n = element_nodes(system.problem.mesh), system.displacement_count
    sides = table[:, [[0, 1, 4], [1, 2, 5], [0, 2, 6], [0, 3, 7], [1, 3, 8], [2, 3, 9]]]
    x, free = x.copy(), np.ones(n, dtype=bool)
    free[system.pattern.held[system.pattern.held < n]] = False
    free = free.reshape(-1, 3)
    for attempt in range(REPAIRS):
        J = np.linalg.det(assembly.deformation(x[: system.field_count], system.elements)[0])
        bad = np.flatnonzero(J.min(axis=1) <= 0.0)
        if not len(bad):
            break
        u = x[:n].reshape(-1, 3)
        near, middle = sides[bad].reshape(-1, 3)[:, :2], sides[bad].reshape(-1, 3)[:, 2]
        target = u.copy()
        target[middle] = u[near].mean(axis=1)
        if attempt:
            around = np.isin(table, table[bad]).any(axis=1)
            total, count = np.zeros_like(u), np.zeros(len(u))
            mean = u[table[around]].mean(axis=1)
            np.add.at(total, table[around], mean[:, None])
            np.add.at(count, table[around], 1.0)
            inner = np.unique(table[bad])
            target[inner] = 0.5 * (u[inner] + total[inner] / count[inner, None])
        x[:n] = np.where(free, target, u).ravel()
    return x
