"""One step of backward Euler for elastic elements: Newton passes with contact and friction inside (eq. 13.4–13.7)."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from massspring.body.body import Body
from massspring.kernels.arrays.layout import BoundaryConditions, Contacts, Nodes, Push
from massspring.kernels.forces.elements import Elements
from massspring.kernels.forces.springs import spring_energy, spring_forces_into
from massspring.kernels.jit.stage_clock import HELD, MULTIPLIER, REVISION, SPRINGS
from massspring.kernels.step.end import add_held_impulse
from massspring.layout.state import State
from massspring.methods.elements.friction import RubbedContact
from massspring.methods.elements.laws import Law
from massspring.methods.elements.tangent import Pattern, Tangent, target_ratios
from massspring.methods.implicit.contact import LongStep, TouchedRows

REVISIONS = 12
"""Most revisions of the touched set in one pass; if it still changes, the next pass continues."""
SUFFICIENT = 1e-4
"""Share of the decrease predicted by the slope that a step must achieve (Armijo)."""
SHORTEST = 2.0**-10
"""Smallest part of the motion of a pass that the line search takes."""
TOUCHING = 1e-9
"""Distance over the correction limit, 0.3 of an edge, within which a node starts a step on an obstacle."""
ROUND_OFF = 1e-13
"""Round-off of a potential over its largest term."""


class Rows(TouchedRows):
    """The contact directions C and their Schur complement with the tangent T of a pass, C T⁻¹ Cᵀ."""

    def __init__(self, tangent: Tangent, nodes: Nodes, contacts: Contacts, surface: np.ndarray, dt: float) -> None:
        super().__init__(nodes, contacts, surface, dt)
        if len(self.nodes):
            self._columns = tangent.columns(self.nodes, self.direction)
            self._lu = lu_factor(
                np.einsum("cri,ri->rc", self._columns[:, self.nodes], self.direction), check_finite=False
            )

    def impulses(self, missing: np.ndarray) -> np.ndarray:
        """γ = (C T⁻¹ Cᵀ)⁻¹ `missing` [kg m], (c,); T alone may be indefinite where obstacles press."""
        return lu_solve(self._lu, missing, check_finite=False) if len(self.nodes) else missing

    def moved_by(self, impulses: np.ndarray) -> np.ndarray:
        """T⁻¹ Cᵀ γ [m], (n, 3)."""
        return np.tensordot(impulses, self._columns, 1)

    def pushes(self, impulses: np.ndarray, like: np.ndarray) -> np.ndarray:
        """Cᵀ γ [kg m], in the shape of `like` (n, 3)."""
        push = np.zeros_like(like)
        np.add.at(push, self.nodes, impulses[:, None] * self.direction)
        return push


@dataclass(frozen=True, eq=False)
class Prepared:
    """Data that a run computes once."""

    body: Body
    elements: Elements
    pattern: Pattern
    constant_parts: dict[tuple[float, float], np.ndarray]
    """Step and damping -> data of the constant part of the tangent."""
    law: Law

    def constant(self, state: State, boundary: BoundaryConditions) -> np.ndarray:
        """Data of (1 + c dt) M + dt² K [kg]."""
        key = boundary.dt, boundary.damping
        if key not in self.constant_parts:
            self.constant_parts[key] = self.pattern.constant(state.model, *key)
        return self.constant_parts[key]

    def resistance(self, state: State, boundary: BoundaryConditions) -> np.ndarray:
        """The diagonal of that part [kg], (n,), 0 where held."""
        diagonal = np.zeros(len(state.model.mass))
        diagonal[self.pattern.free] = self.constant(state, boundary)[self.pattern.diagonal]
        return diagonal


class Ending(NamedTuple):
    """Stopping criteria for the passes of a step."""

    tolerance: float
    """Largest motion of a pass at which the passes end [m]."""
    most: int


class NewtonStep(LongStep):
    """A step of elastic elements."""

    def __init__(self, state: State, boundary: BoundaryConditions, step: int) -> None:
        super().__init__(state, boundary, step)
        self.state = state
        self.prepared: Prepared = state.memory
        filling = boundary.volume_target[step] / self.prepared.body.rest_volumes
        self.elements = with_targets(self.prepared, filling)
        self.weight = self.prepared.body.mass[:, None] * boundary.gravity
        """m g of all nodes [N], (n, 3)."""
        closer = TOUCHING * self.model.correction_limit
        self.contact = RubbedContact(self.model, self.nodes, self.contacts, boundary, step, closer)
        self.contact.resistance = self.prepared.resistance(state, boundary)
        self.force, self.right = np.zeros_like(self.p), np.zeros_like(self.p)
        self.rough = boundary.rough

    def take(self, ending: Ending) -> None:
        """Makes passes until one moves no node by more than the tolerance; then v⁺ = (x⁺ − x)/dt."""
        diagnostics = self.diagnostics
        rows, impulses, count, settled = None, np.zeros(0), 0, False
        while not settled and count < ending.most and np.isfinite(self.p).all():
            if rows is not None:
                self.contact.apply_friction(self.p, rows, impulses)
            self.right = self.imbalance()
            change, rows, impulses, agreed = self.newton_pass()
            part = self.part_of(change, self.given(rows, impulses))
            self.p += part * change
            settled = agreed and part == 1.0 and not np.abs(change).max() > ending.tolerance
            count += 1
            self.end_stage(MULTIPLIER)
        self.count_passes(count)
        diagnostics.limited[0] += not settled
        if rows is not None:
            self.contact.book(rows, impulses, diagnostics.contact_impulse)
        self.book_held()
        self.end()

    def newton_pass(self) -> tuple[np.ndarray, Rows, np.ndarray, bool]:
        """(δ [m], contact rows, their impulses γ [kg m], whether the touched set is final) of one linear step from
        p."""
        for exact in (True, False):
            change, rows, impulses, agreed = self.linear_step(self.tangent(exact))
            if float(np.vdot(self.right + self.given(rows, impulses), change)) >= 0.0:
                break
        return change, rows, impulses, agreed

    def given(self, rows: Rows, impulses: np.ndarray) -> np.ndarray:
        """Impulses of the obstacles on the nodes times dt [kg m], (n, 3)."""
        return rows.pushes(impulses, self.p) + self.contact.friction_impulse

    def linear_step(self, tangent: Tangent) -> tuple[np.ndarray, Rows, np.ndarray, bool]:
        """The same with a given tangent, which need not be positive."""
        free = tangent.respond(self.right)
        self.end_stage(SPRINGS)
        obstacles = len(self.boundary.radius) > 0
        agreed = not obstacles
        for revision in range(REVISIONS):
            rows = Rows(tangent, self.nodes, self.contacts, self.model.surface_nodes, self.boundary.dt)
            change, impulses = self.past_obstacles(free, tangent, rows)
            if agreed or revision + 1 == REVISIONS:
                break
            agreed = not self.contact.revise(self.p + change, rows, impulses)
            if agreed:
                break
        self.end_stage(REVISION)
        return change, rows, impulses, agreed

    def tangent(self, exact: bool) -> Tangent:
        """T at p including the stiffness of friction. If not `exact`: without the geometric part of the pressure, so
        that it is positive."""
        pattern, data = self.prepared.pattern, self.prepared.constant(self.state, self.boundary).copy()
        stiffen = self.prepared.law.add_stiffness
        stiffen(self.elements, pattern.places, self.p, self.boundary.dt**2, exact, data)
        if self.rough:
            pattern.add_at_nodes(data, *self.contact.stiffness(self.p))
        return Tangent(pattern, data)

    def past_obstacles(self, free: np.ndarray, tangent: Tangent, rows: Rows) -> tuple[np.ndarray, np.ndarray]:
        """(δ [m], γ [kg m]): the linear step with friction that ends on the obstacles."""
        if self.rough and self.contact.friction_impulse.any():
            free = free + tangent.respond(self.contact.friction_impulse)
        if not len(rows.nodes):
            return free, np.zeros(0)
        impulses = rows.impulses(rows.place - rows.along(self.p + free))
        return free + rows.moved_by(impulses), impulses

    def imbalance(self) -> np.ndarray:
        """dt M v + dt² (f(p) + m g) − (1 + c dt) M (p − x) [kg m], (n, 3), 0 where held (eq. 13.6)."""
        model, nodes, dt = self.model, self.nodes, self.boundary.dt
        spring_forces_into(self.p, model.ends, model.rest_length, model.stiffness, nodes.force)
        self.idle = self.prepared.law.forces_into(self.elements, self.p, self.force)
        moved = (1.0 + self.boundary.damping * dt) * (self.p - self.nodes.x)
        right = model.mass[:, None] * (dt * nodes.v - moved) + dt * dt * (nodes.force + self.force + self.weight)
        right[model.held_nodes] = 0.0
        return right

    def potential(self, p: np.ndarray) -> tuple[float, float]:
        """The potential that the step minimises [kg m²], whose gradient is minus the imbalance, and the sum of the
        sizes of its terms."""
        model, dt, moved = self.model, self.boundary.dt, p - self.nodes.x
        mass = model.mass[:, None]
        inertia = 0.5 * (1.0 + self.boundary.damping * dt) * float((mass * moved * moved).sum())
        work = float((moved * (dt * mass * self.nodes.v + dt * dt * self.weight)).sum())
        springs = dt * dt * float(spring_energy(p, model.ends, model.rest_length, model.stiffness))
        volumes = dt * dt * float(self.prepared.law.energy(self.elements, p))
        return inertia - work + springs + volumes, inertia + abs(work) + abs(springs) + abs(volumes)

    def part_of(self, change: np.ndarray, given: np.ndarray) -> float:
        """Line search: the part of a linear step that is taken, 1, ½, …, so that the potential minus the work of
        obstacles falls (eq. 13.7)."""
        begun, size = self.potential(self.p)
        slope = float(np.vdot(self.right + given, change))
        part = 1.0
        while part > SHORTEST:
            gained = self.potential(self.p + part * change)[0] - begun - part * float(np.vdot(given, change))
            if not gained > -SUFFICIENT * part * slope + ROUND_OFF * size:
                break
            part *= 0.5
        return part

    def book_held(self) -> None:
        """Records the impulses of attachments [N s] at the end of the step (eq. 3.6), and whether a volume had no
        gradient."""
        self.imbalance()
        model, nodes, diagnostics = self.model, self.nodes, self.diagnostics
        diagnostics.singular[0] += self.idle
        # Gravity acts on the mass of the body, not on the inertial mass.
        nodes.force[:] += self.weight - model.mass[:, None] * self.boundary.gravity
        push = Push(self.force, 1.0)
        add_held_impulse(model, nodes, push, self.boundary.dt, self.boundary.gravity, diagnostics.held_impulse)
        self.end_stage(HELD)


def with_targets(prepared: Prepared, filling: np.ndarray) -> Elements:
    """The elements with targets `filling` (m,) of the kept volumes over their rest volumes."""
    return prepared.elements._replace(target_ratio=target_ratios(prepared.body, filling))


def missing(prepared: Prepared, x: np.ndarray, filling: np.ndarray) -> np.ndarray:
    """Target minus volume of each kept volume, over its rest volume [1], (m,)."""
    return filling - prepared.body.kept.measure(x) / prepared.body.rest_volumes
