"""A body in three dimensions with held regions and obstacles: NGSolve, third order, on quadratic tetrahedra.

Frictionless obstacles push by a penalty, whose potential is ½ stiffness ∫ d² dA over the surface that is not held, d
[m] the depth inside the obstacle. The load path is computed at second order. Newton's method at third order starts from
its end, so only the last state is of third order.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.spatial import KDTree
from skfem import MeshTet

from reference_fem.crosscheck.newton import Newton
from reference_fem.crosscheck.ngsolve_code import EDGE, load, to_ngsolve
from reference_fem.elements.evaluate import Evaluator
from reference_fem.elements.shapes import check_neighbours, edge_index, facet_nodes, nodes
from reference_fem.errors import SolveError
from reference_fem.model.material import NeoHookean
from reference_fem.model.obstacles import PLANE, Obstacle, RigidCapsule, finite_vector
from reference_fem.model.problem import PrescribedDisplacement, Problem

PATH_ORDER, ORDER = 2, 3
"""Orders of the displacement along the path and at its end; those of the pressure are one less."""
STIFF = 1e4
"""Stiffness of contact times size over shear modulus: under a pressure of mu a point penetrates by 1e-4 of the size."""
EXTRA, CONTACT = 2, 14
"""Orders of quadrature. EXTRA: in the body, beyond twice that of the displacement. CONTACT: on the surface, high
because contact ends inside facets."""
FREE = "free"
"""Name of the surface that is not held."""


@dataclass(frozen=True, eq=False)
class SolidSolution:
    """The end of a path."""

    obstacle_force: np.ndarray
    """Force of each obstacle on the body, (no, 3) [N]."""
    held_force: np.ndarray
    """Force of each held region on the body, (nh, 3) [N]."""
    unknowns: int
    problem: Problem
    mesh: Any
    u: Any
    """NGSolve's displacement."""
    bend: Any
    """Keeps the curves of NGSolve's mesh alive."""

    def displacement(self, points: np.ndarray, among: np.ndarray | None = None) -> np.ndarray:
        """(n, 3) [m] at rest points (n, 3) [m]; outside the body extrapolated from the nearest element.

        among: the elements that are searched, (ne,) bool: a place on a cut is in those on both sides of it.
        """
        chosen = np.arange(self.problem.mesh.nelements) if among is None else np.flatnonzero(among)
        index, local = self._evaluator(chosen).locate(points)
        return self._at(chosen[index], local)

    def _at(self, elements: np.ndarray, local: np.ndarray) -> np.ndarray:
        ng = load("ngsolve")
        moves = np.empty((len(elements), 3))
        for k, (element, place) in enumerate(zip(elements, local, strict=True)):
            corners = self.problem.mesh.t[:4, element].tolist()
            weights = dict(zip(corners, (1.0 - place.sum(), *place), strict=True))
            number = ng.ElementId(ng.VOL, int(element))
            theirs = [weights[vertex.nr] for vertex in self.mesh[number].vertices]
            element_map = self.mesh.GetTrafo(number)  # must live as long as the point
            moves[k] = self.u(element_map(*theirs[:3]))
        return moves

    def _evaluator(self, chosen: np.ndarray) -> Evaluator:
        """The evaluator on the chosen elements, numbered in their order."""
        evaluator = Evaluator(self.problem.mesh)
        evaluator.table, evaluator.corners = evaluator.table[chosen], evaluator.corners[chosen]
        evaluator.tree = KDTree(evaluator.corners.mean(axis=1))
        return evaluator


def check_solid(problem: Problem) -> None:
    """Raises SolveError for problems that are not covered, and for elements that fold."""
    extras = (problem.cavities, problem.loads, np.any(problem.gravity))
    partly = any(held.shape is not None or set(held.components) != {0, 1, 2} for held in problem.held)
    other = any(isinstance(o, RigidCapsule) or o.slip != "frictionless" for o in problem.obstacles)
    if any(extras) or partly or other or not isinstance(problem.material, NeoHookean) or not problem.held:
        raise SolveError("the second judge covers neo-Hookean bodies, wholly held regions, smooth planes and spheres")
    check_neighbours(problem.mesh)


def boundaries(problem: Problem) -> dict[str, np.ndarray]:
    """Boundary facets (f, 3) by their vertices: "held0", "held1", ... all nodes of which are held, and the FREE rest.

    Raises SolveError for a region without a facet.
    """
    table, x = facet_nodes(problem.mesh), nodes(problem.mesh)
    surface, rest, facets = np.unique(table), np.ones(len(table), dtype=bool), {}
    for number, held in enumerate(problem.held):
        inside = np.zeros(len(x), dtype=bool)
        inside[surface] = held.where(x[surface].T)
        whole = inside[table].all(axis=1) & rest
        if not whole.any():
            raise SolveError(
                f"held region {number} contains no whole boundary facet: choose a larger one, or finer mesh"
            )
        facets[f"held{number}"], rest = table[whole, :3], rest & ~whole
    return facets | {FREE: table[rest, :3]}


def curved_body(mesh: MeshTet, facets: dict[str, np.ndarray]) -> tuple[Any, Any]:
    """NGSolve's mesh with boundaries, and the field by which its points deviate from straight elements, as in the
    curved `mesh`."""
    ng, body = load("ngsolve"), to_ngsolve(mesh, facets)
    bend = ng.GridFunction(ng.VectorH1(body, order=2))
    ours = edge_index(mesh, np.array([[vertex.nr for vertex in edge.vertices] for edge in body.edges]))
    x, corners = nodes(mesh), mesh.nvertices
    bulge = x[corners:] - x[mesh.edges].mean(axis=0)
    bend.vec.FV().NumPy().reshape(3, -1)[:, corners:] = bulge[ours].T / EDGE
    body.SetDeformation(bend)
    return body, bend


class Solid:
    """The body in NGSolve at one order: space, potential, and which unknowns are held."""

    def __init__(self, problem: Problem, body: Any, order: int, stiff: float):
        ng, material = load("ngsolve"), problem.material
        assert isinstance(material, NeoHookean)  # checked before
        size = float(np.ptp(nodes(problem.mesh), axis=0).max())
        self.problem, self.mesh, self.scale = problem, body, material.mu * size**2
        self.stiffness = stiff * material.mu / size
        self.space = ng.VectorH1(body, order=order, dirichlet="held.*") * ng.H1(body, order=order - 1)
        self.state, self.form = ng.GridFunction(self.space), ng.BilinearForm(self.space, symmetric=True)
        self.places = [[ng.Parameter(0.0) for _ in range(3)] for _ in problem.obstacles]
        u, share = self.space.TrialFunction()
        p, F = material.mu * share, ng.Id(3) + ng.Grad(u)
        J = ng.Det(F)
        energy = 0.5 * material.mu * (J ** (-2.0 / 3.0) * ng.InnerProduct(F, F) - 3.0)
        energy += p * (J - 1.0) - p * p / (2.0 * material.kappa)
        self.form += ng.Variation(energy.Compile() * ng.dx(bonus_intorder=EXTRA))
        points = {ng.ET.TRIG: ng.IntegrationRule(ng.ET.TRIG, CONTACT)}
        self.outside = ng.ds(FREE, intrules=points)
        for number in range(len(problem.obstacles)):
            depth, _ = self.depth(number, u)
            self.form += ng.Variation((0.5 * self.stiffness * depth * depth).Compile() * self.outside)
        self.newton = Newton(self.form, self.state, self.space.FreeDofs())

    def depth(self, number: int, u: Any) -> tuple[Any, Any]:
        """How deep points displaced by u are inside an obstacle [m], 0 outside, and its normal towards the body."""
        ng, row = load("ngsolve"), self.problem.obstacles[number].row()
        off = ng.CF((ng.x, ng.y, ng.z)) + u - ng.CF(tuple(row[1:4])) - ng.CF(tuple(self.places[number]))
        if row[0] == PLANE:
            normal = ng.CF(tuple(row[4:7]))
            gap = ng.InnerProduct(off, normal)
        else:
            away = ng.sqrt(ng.InnerProduct(off, off))
            normal, gap = off / away, away - row[7]
        return ng.IfPos(gap, 0.0, -gap), normal

    def moved(self, region: int, by: np.ndarray) -> np.ndarray:
        """All unknowns of a field that is `by`, (3,) [m], on a held region and 0 at all others."""
        ng = load("ngsolve")
        field = ng.GridFunction(self.space)
        field.components[0].Set(ng.CF(tuple(map(float, by))), definedon=self.mesh.Boundaries(f"held{region}"))
        return field.vec.FV().NumPy().copy()

    def advance(self, before: float, t: float) -> None:
        """From the time before to t [s]. Raises SolveError when the step is too long."""
        self.place(t)
        steps = [motion(held, t) - motion(held, before) for held in self.problem.held]
        if np.any(steps):
            self.newton.lift(np.sum([self.moved(k, step) for k, step in enumerate(steps)], axis=0))
        self.newton.converge(self.scale)

    def place(self, t: float) -> None:
        """Obstacles where they are at time t [s]."""
        for place, obstacle in zip(self.places, self.problem.obstacles, strict=True):
            for parameter, value in zip(place, motion(obstacle, t), strict=True):
                parameter.Set(float(value))

    def obstacle_force(self, number: int) -> np.ndarray:
        """Force of an obstacle on the body, (3,) [N]."""
        ng = load("ngsolve")
        depth, normal = self.depth(number, self.state.components[0])
        return np.array([ng.Integrate(self.stiffness * depth * part * self.outside, self.mesh) for part in normal])

    def held_force(self, number: int) -> np.ndarray:
        """Force of a held region on the body, (3,) [N]."""
        residual = self.newton.residual()
        return np.array([self.moved(number, axis) @ residual for axis in np.eye(3)])


def motion(moving: PrescribedDisplacement | Obstacle, t: float) -> np.ndarray:
    """Displacement of a held region or an obstacle at time t [s], (3,) [m]."""
    return np.zeros(3) if moving.motion is None else finite_vector(moving.motion(t), f"a motion at t = {t:g} s")


def solve_solid(problem: Problem, times: Sequence[float], stiff: float = STIFF) -> SolidSolution:
    """The state at the last of the times [s], reached from rest; stiff: stiffness of contact times size over shear
    modulus.

    Raises SolveError for a problem that is not covered, elements that fold, and steps that are too long.
    """
    check_solid(problem)
    body, bend = curved_body(problem.mesh, boundaries(problem))
    path = Solid(problem, body, PATH_ORDER, stiff)
    for before, t in pairwise((0.0, *times)):
        path.advance(before, t)
    end = Solid(problem, body, ORDER, stiff)
    for fine, coarse in zip(end.state.components, path.state.components, strict=True):
        fine.Set(coarse)
    end.place(times[-1])
    end.newton.converge(end.scale)
    pushed = np.array([end.obstacle_force(k) for k in range(len(problem.obstacles))]).reshape(-1, 3)
    held = np.array([end.held_force(k) for k in range(len(problem.held))])
    return SolidSolution(pushed, held, end.space.ndof, problem, body, end.state.components[0], bend)
