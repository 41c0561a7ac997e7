"""The same problem in NGSolve, with NGSolve's P2/P1 spaces, derivatives of the energy, and Newton solver.

NGSolve (Schöberl 2014, C++11 implementation of finite elements in NGSolve) differentiates the energy symbolically;
it takes only the mesh, the held values and the quadrature points from this project.
"""

import importlib
import importlib.util
from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from typing import Any

import numpy as np
from skfem import MeshTet
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from reference_fem import HeldNodes, NeoHookean, Problem, SolveError, find_held, nodes

INVERSE = "sparsecholesky"
EDGE = -0.125
"""Value of NGSolve's edge function half-way: u there is the mean of the ends plus this times the coefficient."""


def available() -> bool:
    """Whether the extra `crosscheck` is installed."""
    return importlib.util.find_spec("ngsolve") is not None


def load(name: str) -> Any:
    """A module of NGSolve; raises SolveError where the extra is missing."""
    if not available():
        raise SolveError("NGSolve is not installed: install the extra, pip install organbench[crosscheck]")
    return importlib.import_module(name)


@dataclass(frozen=True, eq=False)
class NgsolveSolution:
    """Solution by NGSolve, with nodes and vertices numbered as in this project."""

    u: np.ndarray
    """Displacement of the P2 nodes, (N2, 3) [m]."""
    p: np.ndarray
    """Pressure at the vertices, (N1,) [Pa]."""
    held_force: np.ndarray
    """Force of each held region on the body, (nh, 3) [N]; a shared unknown counts for the first region."""


def to_ngsolve(mesh: MeshTet):
    """The tetrahedra with straight sides as an NGSolve mesh, vertices in the same order."""
    net = load("netgen.meshing").Mesh(dim=3)
    net.AddPoints(np.ascontiguousarray(mesh.p[:, : mesh.nvertices].T))
    net.AddElements(dim=3, index=1, data=np.ascontiguousarray(mesh.t[:4].T, dtype=np.int32), base=0)
    return load("ngsolve").Mesh(net)


def check(problem: Problem):
    """Raises SolveError for problems that this translation does not cover."""
    extras = (problem.obstacles, problem.cavities, problem.loads, np.any(problem.gravity))
    if any(extras) or not isinstance(problem.material, NeoHookean):
        raise SolveError("the cross-check covers neo-Hookean bodies with held regions and nothing else")
    if problem.mesh.doflocs.shape[1] > problem.mesh.nvertices:
        raise SolveError("the cross-check takes straight elements: give a MeshTet that is not curved")


def check_middles(mesh: MeshTet, held: list[HeldNodes]):
    """Refuse a held mid-side node between free vertices: NGSolve's edge function is measured from the vertices."""
    taken = np.zeros((len(nodes(mesh)), 3), dtype=bool)
    for region in held:
        taken[np.ix_(region.nodes, region.components)] = True
    loose = taken[mesh.nvertices :] & ~taken[mesh.edges].all(axis=0)
    if loose.any():
        raise SolveError(
            f"{loose.any(axis=1).sum()} mid-side nodes are held while a vertex beside them is free: hold whole facets"
        )


class NgsolveModel:
    """A problem in NGSolve. Raises SolveError for problems that it does not cover."""

    def __init__(self, problem: Problem):
        check(problem)
        ng = load("ngsolve")
        self.problem, self.held = problem, find_held(problem)
        self.mesh = to_ngsolve(problem.mesh)
        space = ng.VectorH1(self.mesh, order=2) * ng.H1(self.mesh, order=1)
        self.state = ng.GridFunction(space)
        points, weights = get_quadrature(RefTet, problem.order)
        rule = ng.IntegrationRule(points=[tuple(map(float, x)) for x in points.T], weights=[float(w) for w in weights])
        u, p = space.TrialFunction()
        F, material = ng.Id(3) + ng.Grad(u), problem.material
        J = ng.Det(F)
        energy = 0.5 * material.mu * (J ** (-2.0 / 3.0) * ng.InnerProduct(F, F) - 3.0)
        energy += p * (J - 1.0) - p * p / (2.0 * material.kappa)
        self.form = ng.BilinearForm(space, symmetric=True)
        self.form += ng.Variation(energy.Compile() * ng.dx(intrules={ng.ET.TET: rule}))
        pairs = np.array([[vertex.nr for vertex in edge.vertices] for edge in self.mesh.edges])
        number = {tuple(sorted(pair)): at for at, pair in enumerate(np.asarray(problem.mesh.edges).T.tolist())}
        self.edges = np.array([number[tuple(sorted(pair))] for pair in pairs.tolist()])
        check_middles(problem.mesh, self.held)
        self.free = ng.BitArray(space.ndof)
        self.free.Set()
        for held in self.held:
            for number in self.numbers(held).ravel():
                self.free[int(number)] = False

    def numbers(self, held: HeldNodes):
        """NGSolve's unknowns of a held region, (k, nodes): components one after the other, vertices, then edges."""
        count = len(nodes(self.problem.mesh))
        place = np.concatenate((np.arange(self.mesh.nv), self.mesh.nv + np.argsort(self.edges)))
        return place[held.nodes] + count * np.array(held.components)[:, None]

    def vector(self):
        """All unknowns, as NGSolve numbers them."""
        return self.state.vec.FV().NumPy()

    def fields(self, vector: Any):
        """(u (N2, 3), p (N1,)) in this project's numbers."""
        mesh = self.problem.mesh
        parts = vector[: 3 * len(nodes(mesh))].reshape(3, -1)
        ends, bulge = parts[:, : mesh.nvertices], np.empty((3, len(self.edges)))
        bulge[:, self.edges] = EDGE * parts[:, mesh.nvertices :]
        middles = ends[:, mesh.edges].mean(axis=1) + bulge
        return np.hstack((ends, middles)).T, vector[3 * len(nodes(mesh)) :].copy()

    def increments(self, t: float):
        """Increments of the held unknowns that lead to time t, as NGSolve's coefficients, zero elsewhere."""
        mesh = self.problem.mesh
        u, _ = self.fields(self.vector())
        target = u.copy()
        for held in self.held:
            for component, values in zip(held.components, held.displacement(t), strict=True):
                target[held.nodes, component] = values
        moved = (target - u).T
        ends, middles = moved[:, : mesh.nvertices], moved[:, mesh.nvertices :]
        # a free end moves with the solution, so its share of the increment is left to the solution as well
        bulge = (middles - ends[:, mesh.edges].mean(axis=1)) / EDGE
        step = np.zeros(len(self.vector()))
        step[: moved.size] = np.hstack((ends, bulge[:, self.edges])).ravel()
        step[np.array(self.free)] = 0.0
        return step

    def advance(self, t: float):
        """To time t in one step: the prescribed increment through the tangent, then Newton."""
        form, vec = self.form, self.state.vec
        step = vec.CreateVector()
        step.FV().NumPy()[:] = self.increments(t)
        form.AssembleLinearization(vec)
        pulled = (form.mat * step).Evaluate()
        vec.data += step - form.mat.Inverse(self.free, inverse=INVERSE) * pulled
        self.newton()

    def newton(self, most: int = 20):
        """Runs NGSolve's Newton solver from the current state. Raises SolveError when it does not converge."""
        newton = load("ngsolve.solvers").Newton
        with redirect_stdout(StringIO()):  # the status says what it prints
            status, _ = newton(
                self.form, self.state, freedofs=self.free, inverse=INVERSE, maxerr=1e-9, maxit=most, printing=False
            )
        if status != 0:
            raise SolveError(f"NGSolve's Newton did not converge in {most} iterations: take shorter steps")

    def forces(self):
        """Force of each held region, (nh, 3) [N], from the residual of NGSolve's form."""
        mesh, residual = self.problem.mesh, self.state.vec.CreateVector()
        self.form.Apply(self.state.vec, residual)
        parts = residual.FV().NumPy()[: 3 * len(nodes(mesh))].reshape(3, -1)
        middles, ends = np.empty((3, len(self.edges))), parts[:, : mesh.nvertices].copy()
        middles[:, self.edges] = parts[:, mesh.nvertices :] / EDGE
        for side in np.asarray(mesh.edges):
            for force, part in zip(ends, middles, strict=True):
                force -= 0.5 * np.bincount(side, part, minlength=mesh.nvertices)
        left, forces = np.hstack((ends, middles)).T, np.zeros((len(self.held), 3))
        for k, held in enumerate(self.held):
            for component in held.components:
                forces[k, component] = left[held.nodes, component].sum()
                left[held.nodes, component] = 0.0
        return forces


def solve(problem: Problem, times: Sequence[float]) -> NgsolveSolution:
    """The state at the last of the times, reached step by step; raises SolveError."""
    model = NgsolveModel(problem)
    for t in times:
        model.advance(t)
    return NgsolveSolution(*model.fields(model.vector()), model.forces())
