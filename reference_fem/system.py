"""The discrete system of one problem: residual, tangent and Newton's direction under given loads."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from reference_fem import assembly, checks, contact
from reference_fem.elements import build_elements, build_facets, nodes
from reference_fem.errors import ReferenceProblem
from reference_fem.linear import SymmetricSolver
from reference_fem.pattern import build_pattern
from reference_fem.problem import Problem, find_held, nodal_volumes


@dataclass(frozen=True)
class NewtonSettings:
    """How hard to try. Tolerances are relative: force to the largest of reactions, contact and weight; volume to V0."""

    force_tol: float = 1e-6
    volume_tol: float = 1e-8
    penetration_tol: float = 1e-3
    """Deepest contact penetration over the largest displacement; more than that and the multiplier is updated."""
    penalty: float = 30.0
    """Contact penalty times facet size over mu. Soft, and left to the multiplier: on a deep spherical probe 30 to 300
    take about as many iterations and agree to 6e-4 in the force, but 300 needs sub-steps and 1000 can fail."""
    max_iterations: int = 25
    smallest_step: float = 1.0 / 1024.0
    """Smallest sub-step, as a fraction of the interval between two wanted times."""
    start: float = 0.0
    """Time [s] of the undeformed state."""
    solver: str = "auto"


@dataclass
class State:
    """Unknowns and multipliers at time t under a share `load` of gravity; `iterations` spent to come here."""

    t: float
    load: float
    x: np.ndarray
    multiplier: np.ndarray
    iterations: int = 0
    stiffness: float = 1.0


class Loads(NamedTuple):
    """What acts during one evaluation: share of gravity, obstacles (no, 8), multipliers, penalty factor.

    shift (no, 3) [m]: a further move of the obstacles to be linearised, None = none.
    """

    gravity: float
    rows: np.ndarray
    multiplier: np.ndarray
    stiffness: float = 1.0
    shift: np.ndarray | None = None


@dataclass
class Evaluation:
    """Residual (full), tangent values, least J, contact state, and the two relative errors that Newton drives down."""

    residual: np.ndarray
    values: np.ndarray
    smallest_J: float
    touch: contact.Touch
    errors: np.ndarray

    @property
    def usable(self):
        return self.smallest_J > 0.0 and np.isfinite(self.errors).all()


class System:
    """Tables, pattern and solver of a problem. Raises ReferenceProblem for what cannot be solved."""

    def __init__(self, problem: Problem, settings: NewtonSettings):
        mesh, self.problem, self.settings = problem.mesh, problem, settings
        checks.check_mesh(mesh)
        checks.check_loads(problem)
        self.nodes = nodes(mesh)
        self.displacement_count = 3 * len(self.nodes)
        self.total = self.displacement_count + mesh.nvertices
        self.elements = build_elements(mesh, problem.order)
        self.volume = float(self.elements.weights.sum())
        self.held = find_held(problem)
        mask = np.zeros(self.total, dtype=bool)
        for held in self.held:
            mask[held.dofs] = True
        self.check_freedom(np.flatnonzero(mask))
        self.pattern = build_pattern(self.elements.dofs, mask)
        self.positions = self.pattern.positions(self.elements.dofs)
        self.surface = self.build_surface()
        self.rows = np.array([obstacle.row() for obstacle in problem.obstacles]).reshape(-1, 8)
        self.weight = self.gravity_force()
        start = contact.place(self.rows, problem.obstacles, settings.start)
        checks.check_start(self.surface, start, checks.boundary_size(mesh))
        self.solver = SymmetricSolver(settings.solver)

    def check_freedom(self, held_dofs):
        """At rest nothing else balances a load than the holders: every rigid motion must be held."""
        checks.check_held(self.nodes, held_dofs)

    def build_surface(self):
        facets = build_facets(self.problem.mesh, self.problem.contact_order)
        dofs = np.hstack([3 * facets.nodes + c for c in range(3)])
        penalty = self.settings.penalty * self.problem.material.mu / np.sqrt(facets.weights.sum(axis=1))
        positions = self.pattern.positions(dofs)
        rest = self.nodes.ravel()
        return contact.Surface(dofs.astype(np.uint32), positions, rest, facets.values, facets.weights, penalty)

    def gravity_force(self):
        force = np.zeros(self.total)
        pull = self.problem.density * np.asarray(self.problem.gravity, dtype=float)
        volumes = nodal_volumes(self.problem.mesh, self.elements.weights, self.problem.order)
        force[: self.displacement_count] = np.outer(volumes, pull).ravel()
        return force

    def rest(self) -> State:
        shape = (len(self.rows), *self.surface.weights.shape)
        return State(self.settings.start, 0.0, np.zeros(self.total), np.zeros(shape))

    def obstacles_at(self, t):
        return contact.place(self.rows, self.problem.obstacles, t)

    def held_at(self, t):
        """Prescribed values of the held unknowns at time t; refuses regions that contradict each other."""
        wanted = np.full(self.total, np.nan)
        for k, held in enumerate(self.held):
            value, there = held.displacement(t), wanted[held.dofs]
            clash = np.abs(value - there) > 1e-9 * (np.abs(value) + np.abs(there))
            if clash.any():
                raise ReferenceProblem(
                    f"held region {k} prescribes {value[clash][0]:g} m where an earlier one prescribes "
                    f"{there[clash][0]:g} m at t = {t:g} s: let them not overlap, or agree"
                )
            wanted[held.dofs] = value
        return wanted[self.pattern.held]

    def evaluate(self, x, loads: Loads, tangent=True) -> Evaluation:
        """Residual and, if wanted, tangent at x under the loads."""
        residual = -loads.gravity * self.weight
        values = np.zeros(self.pattern.size if tangent else 1)
        shift = np.zeros((len(loads.rows), 3)) if loads.shift is None else loads.shift
        penalty = loads.stiffness * self.surface.penalty
        touch = contact.touch(loads.rows, shift, loads.multiplier, penalty)
        parameters = self.problem.material.parameters
        J = assembly.add_elements(x, self.elements, parameters, self.positions, values, residual, tangent)
        if J > 0.0 and len(loads.rows):
            contact.add_contact(x, self.surface, touch, values, residual, tangent)
        return Evaluation(residual, values, J, touch, self.relative_errors(residual, touch, loads.gravity))

    def relative_errors(self, residual, touch, load):
        """(unbalanced force over the forces at work, volume misfit over V0)."""
        n = self.displacement_count
        free = np.zeros(self.total)
        free[self.pattern.free] = residual[self.pattern.free]
        floor = 1e-9 * self.problem.material.mu * self.volume ** (2.0 / 3.0)
        held = residual[self.pattern.held]
        sizes = (np.linalg.norm(held), np.abs(touch.force).sum(), load * np.linalg.norm(self.weight), floor)
        return np.array([np.linalg.norm(free[:n]) / max(sizes), np.abs(free[n:]).sum() / self.volume])

    def step(self, found: Evaluation, x, target):
        """Newton direction at x that also takes the held unknowns to their target."""
        direction = np.zeros(self.total)
        lift = target - x[self.pattern.held]
        load = -found.residual[self.pattern.free] - self.pattern.lifting(found.values) @ lift
        self.solver.factor(self.pattern.upper(found.values))
        direction[self.pattern.free] = self.solver.solve(load)
        direction[self.pattern.held] = lift
        return direction
