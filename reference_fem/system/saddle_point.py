"""The discrete system of one problem: residual, tangent and Newton's direction under given loads."""

from dataclasses import dataclass, replace

import numpy as np

from reference_fem.contact import augmented as contact
from reference_fem.contact.faces import Faces, FaceTouch, add_faces, coincident, no_faces
from reference_fem.contact.inside import Inside
from reference_fem.elements.shapes import Facets, build_elements, build_facets, nodes
from reference_fem.elements.surface import Surface
from reference_fem.errors import SolveError
from reference_fem.model import cavity, obstacles
from reference_fem.model.loads import BodyForce, find_points, nodal_force
from reference_fem.model.problem import Problem, find_held
from reference_fem.system import assembly, checks
from reference_fem.system.linear import SymmetricSolver
from reference_fem.system.pattern import build_pattern
from reference_fem.system.state import Loads, NewtonSettings, State

TOUCHING = 1e-6
"""Gap over the size of the body below which a point sticks to a no-slip obstacle from the start: only round-off."""


@dataclass
class Evaluation:
    """Residual (full), tangent values, least J, contact state, and the two relative errors that Newton reduces."""

    residual: np.ndarray
    """One entry for each unknown; those of the cavities are volume misfits [m³], or pressure misfits [Pa]."""
    values: np.ndarray
    smallest_J: float
    touch: contact.Touch
    errors: np.ndarray
    volumes: np.ndarray
    """Of the cavities, (nc,) [m³]."""
    gradients: np.ndarray
    """dV/dx of the cavities, (nc, field_count) [m²]."""
    faces: FaceTouch
    """Contact between the faces of a cut."""

    @property
    def usable(self):
        """Whether no element is inside out and both errors are finite."""
        return self.smallest_J > 0.0 and np.isfinite(self.errors).all()


class System:
    """Tables, pattern and solver of a problem. Raises SolveError for what cannot be solved."""

    def __init__(self, problem: Problem, settings: NewtonSettings):
        mesh, self.problem, self.settings = problem.mesh, problem, settings
        checks.check_mesh(mesh)
        checks.check_loads(problem)
        self.nodes = nodes(mesh)
        self.displacement_count = 3 * len(self.nodes)
        self.field_count = self.displacement_count + mesh.nvertices
        self.total = self.field_count + len(problem.cavities)
        self.elements = build_elements(mesh, problem.order)
        self.volume = float(self.elements.weights.sum())
        self.held = find_held(problem)
        mask = np.zeros(self.field_count, dtype=bool)
        for held in self.held:
            mask[held.dofs] = True
        self.check_freedom(np.flatnonzero(mask))
        facets = build_facets(mesh, problem.contact_order)
        pairs = coincident(facets, self.nodes) if problem.faces_touch else np.zeros((0, 2, facets.nodes.shape[1]), int)
        apart = (3 * pairs[:, :, None] + np.arange(3)[:, None]).reshape(len(pairs), 6 * pairs.shape[2])
        self.pattern = build_pattern(self.elements.dofs, mask, *([apart] if len(apart) else []))
        self.positions = self.pattern.positions(self.elements.dofs)
        self.surface = self.build_surface(facets)
        self.faces = self.build_faces(facets, pairs[:, 0], apart)
        self.lumens = cavity.find_lumens(problem, self.pattern, facets.nodes, self.held)
        self.rows = np.array([obstacle.row() for obstacle in problem.obstacles]).reshape(-1, 8)
        self.sticks = obstacles.sticky(problem.obstacles)
        self.loaded = self.find_loads()
        start = self.obstacles_at(settings.start)
        checks.check_start(self.surface, start, checks.boundary_size(mesh))
        self.inside = Inside(self.surface, start)
        self.solver = SymmetricSolver(settings.solver)

    def check_freedom(self, held_dofs: np.ndarray):
        """Raises SolveError unless every rigid motion is held: in equilibrium only holders balance a load."""
        checks.check_held(self.nodes, held_dofs)

    def build_surface(self, facets: Facets):
        dofs = np.hstack([3 * facets.nodes + c for c in range(3)])
        penalty = self.settings.penalty * self.problem.material.mu / np.sqrt(facets.weights.sum(axis=1))
        positions = self.pattern.positions(dofs)
        rest = self.nodes.ravel()
        return Surface(dofs.astype(np.uint32), positions, rest, facets.values, facets.weights, penalty)

    def build_faces(self, facets: Facets, behind: np.ndarray, dofs: np.ndarray) -> Faces:
        """Tables of the faces of a cut, `behind` (nf, 6) the nodes behind it, `dofs` (nf, 36) the unknowns of both."""
        if not len(dofs):
            return no_faces(*facets.values.shape)
        place = {tuple(row): k for k, row in enumerate(facets.nodes)}
        at = np.array([place[tuple(row)] for row in behind])
        tables = dofs.astype(np.uint32), self.pattern.positions(dofs)
        shapes = facets.values, facets.slopes, facets.weights[at], self.surface.penalty[at]
        return Faces(*tables, self.nodes.ravel(), *shapes)

    def find_loads(self):
        """The dead loads at their quadrature points, weight among them."""
        loads, pull = list(self.problem.loads), self.problem.density * np.asarray(self.problem.gravity, dtype=float)
        if pull.any():
            loads.append(BodyForce(lambda t, x: np.repeat(pull[:, None], x.shape[1], axis=1)))
        return [find_points(load, self.problem.mesh, self.problem.order) for load in loads]

    def force_at(self, t: float, share: float = 1.0):
        """Share of all dead forces at time t, (field_count,) [N]."""
        force = np.zeros(self.field_count)
        for points in self.loaded:
            force[: self.displacement_count] += share * nodal_force(points, t)
        for hung in self.problem.masses:
            force[3 * hung.node : 3 * hung.node + 3] += share * hung.mass * np.asarray(self.problem.gravity)
        return force

    def rest(self) -> State:
        shape = (len(self.rows), *self.surface.weights.shape)
        x, start = np.zeros(self.total), self.settings.start
        grip = contact.first_grip(self.obstacles_at(start), self.sticks, self.surface, x, TOUCHING * np.ptp(self.nodes))
        faces = np.zeros(self.faces.weights.shape)
        rest = State(start, 0.0, x, np.zeros(shape), np.zeros(shape), grip=grip, hold=grip)
        return replace(rest, faces=faces, face_pressure=faces)

    def obstacles_at(self, t: float):
        """Rows of the obstacles at time t, (no, 8)."""
        return obstacles.place(self.rows, self.problem.obstacles, t)

    def filling_at(self, t: float, load: float):
        """Targets of the cavities at time t, see Loads.filling."""
        return np.array([lumen.target(t, load) for lumen in self.lumens])

    def starts_loaded(self):
        """Whether a force or the content of a cavity has to be applied at the start time."""
        start = self.settings.start
        return bool(np.any(self.force_at(start)) or np.any(self.filling_at(start, 1.0) != self.filling_at(start, 0.0)))

    def loads_of(self, state: State) -> Loads:
        rows, filling = self.obstacles_at(state.t), self.filling_at(state.t, state.load)
        force = self.force_at(state.t, state.load)
        return Loads(force, rows, state.multiplier, filling, state.stiffness, grip=state.grip, faces=state.faces)

    def held_at(self, t: float):
        """Prescribed values of the held unknowns at time t. Raises SolveError for regions that contradict each
        other."""
        target = np.full(self.field_count, np.nan)
        for k, held in enumerate(self.held):
            value, there = held.displacement(t), target[held.dofs]
            clash = np.abs(value - there) > 1e-9 * (np.abs(value) + np.abs(there))
            if clash.any():
                raise SolveError(
                    f"held region {k} prescribes {value[clash][0]:g} m where an earlier one prescribes "
                    f"{there[clash][0]:g} m at t = {t:g} s: let them not overlap, or agree"
                )
            target[held.dofs] = value
        return target[self.pattern.held]

    def evaluate(self, x: np.ndarray, loads: Loads, tangent: bool = True) -> Evaluation:
        """Residual and, if wanted, tangent at x under the loads."""
        residual = np.zeros(self.total)
        residual[: self.field_count] -= loads.force
        values = np.zeros(self.pattern.size if tangent else 1)
        shift = np.zeros((len(loads.rows), 3)) if loads.shift is None else loads.shift
        penalty = loads.stiffness * self.surface.penalty
        touch = contact.touch(loads.rows, shift, loads.multiplier, penalty, loads.grip, loads.guess)
        faces = loads.faces if loads.faces.size else np.zeros(self.faces.weights.shape)
        between = FaceTouch(faces, loads.stiffness * self.faces.penalty, loads.face_guess, np.zeros_like(faces))
        parameters = self.problem.material.parameters
        J = assembly.add_elements(x, self.elements, parameters, self.positions, values, residual, tangent)
        volumes, gradients = np.zeros(len(self.lumens)), np.zeros((len(self.lumens), self.field_count))
        if J > 0.0:
            if len(loads.rows):
                contact.add_contact(x, self.surface, touch, values, residual, tangent)
            if len(self.faces.dofs):
                add_faces(x, self.faces, between, values, residual, tangent)
            for k, (lumen, filling) in enumerate(zip(self.lumens, loads.filling, strict=True)):
                pressure = float(x[self.field_count + k])
                volumes[k] = lumen.add(x, pressure, gradients[k], values, tangent)
                residual[: self.field_count] -= pressure * gradients[k]
                residual[self.field_count + k] = (pressure if lumen.by_pressure else volumes[k]) - filling
        errors = self.relative_errors(x, residual, touch, loads.force, gradients)
        return Evaluation(residual, values, J, touch, errors, volumes, gradients, between)

    def relative_errors(
        self,
        x: np.ndarray,
        residual: np.ndarray,
        touch: contact.Touch,
        force: np.ndarray | float,
        gradients: np.ndarray,
    ):
        """(unbalanced force over the forces at work, misfit of tissue volume or filling over the whole)."""
        n, m, mu = self.displacement_count, self.field_count, self.problem.material.mu
        free = np.zeros(m)
        free[self.pattern.free] = residual[self.pattern.free]
        held = residual[self.pattern.held]
        inside = np.linalg.norm(x[m:] @ gradients)
        floor = 1e-9 * mu * self.volume ** (2.0 / 3.0)
        sizes = (np.linalg.norm(held), np.abs(touch.force).sum(), np.linalg.norm(force), inside, floor)
        misfits = [np.abs(free[n:]).sum() / self.volume]
        for lumen, misfit in zip(self.lumens, residual[m:], strict=True):
            misfits.append(abs(misfit) / (mu if lumen.by_pressure else lumen.volume0))
        return np.array([np.linalg.norm(free[:n]) / max(sizes), max(misfits)])
