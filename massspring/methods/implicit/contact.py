"""Long steps, solved as a whole: their start and end, and the directions and impulses of obstacles (eq. 3.8, 12.3,
12.4)."""

import numpy as np
from scipy.linalg import get_lapack_funcs

from massspring.kernels.arrays.layout import BoundaryConditions, Contacts, Model, Nodes, Push
from massspring.kernels.contact.active_set import release_all
from massspring.kernels.contact.friction import activate_edges
from massspring.kernels.contact.node_contact import FREE, HIDDEN, ON_EDGE, SLIDES, STICKS
from massspring.kernels.jit.stage_clock import INTEGRATION, end_stage
from massspring.kernels.step.begin import look_back
from massspring.kernels.step.implicit_step import activate_entering
from massspring.layout.state import State
from massspring.methods.implicit.factor import Factor

FACTORED, SOLVED = get_lapack_funcs(("potrf", "potrs"), dtype=np.float64)
SLIP_RESOLUTION = 1e-11
"""Slip in a step, over the correction limit of 0.3 of an edge, below which a node does not slide. A sticking node has a
measured slip of 1e-15 to 1e-14 from round-off of the solve, which must not set the direction of friction."""


class LongStep:
    """A step that is solved as a whole, in passes that move p; arrays of the state serve as scratch."""

    def __init__(self, state: State, boundary: BoundaryConditions, step: int) -> None:
        self.boundary, self.step = boundary, step
        self.model, self.nodes, self.contacts = state.model, state.nodes, state.contacts
        self.diagnostics = state.diagnostics
        look_back(self.diagnostics, boundary, step)
        # The start is predicted without gravity: passes that start in equilibrium must stay there, or few passes would
        # be biased.
        self.p = self.nodes.x + boundary.dt * self.nodes.v
        held = self.model.held_nodes
        self.p[held] = self.model.held_rest + boundary.held_displacement[step][self.model.held_group]

    def end_stage(self, stage: int) -> None:
        """Adds the time since the last stage ended to this one, if stages are timed."""
        end_stage(self.diagnostics.stage_times, stage)

    def count_passes(self, count: int) -> None:
        """Records iterations of the step."""
        self.diagnostics.iterations[0] += count
        self.diagnostics.iterations[1] = max(int(self.diagnostics.iterations[1]), count)

    def end(self) -> None:
        """v⁺ = (x⁺ − x)/dt, x⁺ = p."""
        self.nodes.v[:] = (self.p - self.nodes.x) / self.boundary.dt
        self.nodes.x[:] = self.p
        self.end_stage(INTEGRATION)


class TouchedRows:
    """The directions that obstacles remove in a step, as rows C of unit vectors at nodes."""

    def __init__(self, nodes: Nodes, contacts: Contacts, surface_nodes: np.ndarray, dt: float) -> None:
        mode = contacts.mode[surface_nodes]
        slides, on_edge, sticks = (surface_nodes[mode == kind].astype(np.int64) for kind in (SLIDES, ON_EDGE, STICKS))
        axes = np.tile(np.eye(3), (len(sticks), 1))
        self.nodes = np.concatenate([slides, on_edge, on_edge, np.repeat(sticks, 3)])
        self.direction = np.concatenate(
            [contacts.normal[slides], contacts.normal[on_edge], contacts.second_normal[on_edge], axes]
        )
        self.obstacle = contacts.contact_id[self.nodes].astype(np.int64) - 1
        second = len(slides) + len(on_edge) + np.arange(len(on_edge))
        self.obstacle[second] = contacts.second[on_edge].astype(np.int64) - 1
        self.place = np.einsum("ci,ci->c", self.direction, nodes.x[self.nodes] + dt * contacts.v_target[self.nodes])
        """Coordinate along its direction at which each row ends the step [m], (c,)."""

    def along(self, field: np.ndarray) -> np.ndarray:
        """C u, (c,)."""
        return np.einsum("ci,ci->c", self.direction, field[self.nodes])


class ActiveSet(TouchedRows):
    """The current rows and their Schur complement, for a response that does not couple the three components."""

    def __init__(self, factor: Factor, nodes: Nodes, contacts: Contacts, surface_nodes: np.ndarray, dt: float) -> None:
        super().__init__(nodes, contacts, surface_nodes, dt)
        if len(self.nodes):
            self._columns = factor.columns(self.nodes)
            schur = self._columns[:, self.nodes] * (self.direction @ self.direction.T)
            self._root, broken = FACTORED(schur, clean=0)
            if broken:  # C A⁻¹ Cᵀ is positive definite unless entries are not finite; then the run must end
                self._root[:] = np.nan

    def impulses(self, missing: np.ndarray) -> np.ndarray:
        """γ = (C A⁻¹ Cᵀ)⁻¹ `missing` [kg m], (c,): what moves the rows by `missing` [m] (eq. 12.3)."""
        return SOLVED(self._root, missing)[0] if len(self.nodes) else missing

    def moved_by(self, impulses: np.ndarray) -> np.ndarray:
        """A⁻¹ Cᵀ γ [m], (n, 3)."""
        return self._columns.T @ (impulses[:, None] * self.direction)

    def without(self, field: np.ndarray) -> np.ndarray:
        """A response `field` (n, 3) with the part that obstacles take removed: the response of W̃."""
        if not len(self.nodes):
            return field
        return field + self.moved_by(self.impulses(-self.along(field)))


class Contact:
    """The touched nodes of one step and the iteration for the active set."""

    def __init__(
        self,
        model: Model,
        nodes: Nodes,
        contacts: Contacts,
        boundary: BoundaryConditions,
        step: int,
        closer: float = 0.0,
    ) -> None:
        """`closer` [m]: obstacles are enlarged by this at first, to find nodes that lie on them within round-off."""
        self.model, self.nodes, self.contacts = model, nodes, contacts
        self.boundary, self.step = boundary, step
        self.friction_impulse = np.zeros_like(nodes.x)
        """Friction force on the nodes that slip, times dt² [kg m], (n, 3)."""
        release_all(contacts)
        self.boundary = _nearer(boundary, closer) if closer else boundary
        self._activate(np.empty(0, dtype=np.int64), nodes.v)
        self.boundary = boundary

    def revise(self, end: np.ndarray, active: TouchedRows, impulses: np.ndarray) -> bool:
        """Releases nodes that an obstacle would pull, activates those that would enter one, and makes sticking nodes
        slip beyond the friction limit. Returns whether anything changed (eq. 3.8, 12.4)."""
        contacts, nodes = self.contacts, active.nodes
        pushes = np.zeros_like(end)
        np.add.at(pushes, nodes, impulses[:, None] * active.direction)
        sticks = contacts.mode[nodes] == STICKS
        inward = np.where(sticks, np.einsum("ci,ci->c", contacts.normal[nodes], pushes[nodes]), impulses)
        leaving = np.unique(nodes[inward < 0.0])
        contacts.mode[leaving], contacts.contact_id[leaving] = FREE, 0
        self.friction_impulse[leaving] = 0.0
        slipped = self._let_slip(pushes) if self.boundary.rough else 0
        entered = self._activate(leaving, (end - self.nodes.x) / self.boundary.dt)
        return bool(len(leaving) or slipped or entered)

    def _let_slip(self, pushes: np.ndarray) -> int:
        """Makes sticking nodes slip whose tangential impulse exceeds mu times the normal one; returns how many (eq.
        12.4)."""
        contacts = self.contacts
        nodes = np.flatnonzero(contacts.mode == STICKS)
        friction = self.boundary.friction[contacts.contact_id[nodes].astype(np.int64) - 1]
        nodes, friction = nodes[np.isfinite(friction)], friction[np.isfinite(friction)]
        normal, push = contacts.normal[nodes], pushes[nodes]
        pressed = np.einsum("ci,ci->c", normal, push)
        aside = push - pressed[:, None] * normal
        drag = np.linalg.norm(aside, axis=1)
        slips = drag > friction * pressed
        nodes, normal = nodes[slips], normal[slips]
        self.friction_impulse[nodes] = (friction * pressed)[slips, None] * aside[slips] / drag[slips, None]
        contacts.mode[nodes] = SLIDES
        contacts.v_target[nodes] = np.einsum("ci,ci->c", normal, contacts.v_target[nodes])[:, None] * normal
        return len(nodes)

    def apply_friction(self, end: np.ndarray, active: TouchedRows, impulses: np.ndarray) -> bool:
        """Sets friction opposite to the slip of the last pass; a node that friction would push backwards sticks.
        Returns whether one does (eq. 12.4)."""
        boundary = self.boundary
        if not boundary.rough:
            return False
        slides = self.rubbed(active)
        nodes, obstacle = active.nodes[slides], active.obstacle[slides]
        slip, carried = self.slip(end, nodes), boundary.velocity[self.step][obstacle]
        speed = np.linalg.norm(slip, axis=1)
        still = speed * boundary.dt <= SLIP_RESOLUTION * self.model.correction_limit
        driven = still | (np.einsum("ci,ci->c", slip, self.friction_impulse[nodes]) > 0.0)
        most = boundary.friction[obstacle] * np.maximum(impulses[slides], 0.0)
        self.friction_impulse[nodes[~driven]] = -(most[~driven] / speed[~driven])[:, None] * slip[~driven]
        self.stick(nodes[driven], carried[driven])
        return bool(driven.any())

    def book(self, active: TouchedRows, impulses: np.ndarray, given: np.ndarray) -> None:
        """Adds the impulses of obstacles [N s] to `given` (o, 3)."""
        np.add.at(given, active.obstacle, impulses[:, None] / self.boundary.dt * active.direction)
        if self.boundary.rough:
            slipping = np.flatnonzero(self.friction_impulse.any(axis=1))
            obstacle = self.contacts.contact_id[slipping].astype(np.int64) - 1
            np.add.at(given, obstacle, self.friction_impulse[slipping] / self.boundary.dt)

    def meet(self, nodes: np.ndarray, carried: np.ndarray) -> None:
        """Nodes that reach a rough obstacle stick at first."""
        self.stick(nodes, carried)

    def rubbed(self, active: TouchedRows) -> np.ndarray:
        """Which rows belong to nodes that slide on a rough obstacle, (c,) bool."""
        return (self.contacts.mode[active.nodes] == SLIDES) & (self.boundary.friction[active.obstacle] > 0.0)

    def slip(self, end: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        """Slip velocity of touched `nodes` (c,) on their obstacles in a step that ends at `end` (n, 3) [m/s], (c,
        3)."""
        contacts, boundary = self.contacts, self.boundary
        carried = boundary.velocity[self.step][contacts.contact_id[nodes].astype(np.int64) - 1]
        return _aside((end[nodes] - self.nodes.x[nodes]) / boundary.dt - carried, contacts.normal[nodes])

    def stick(self, nodes: np.ndarray, carried: np.ndarray) -> None:
        """Makes nodes move with the velocity `carried` [m/s] of their obstacle."""
        contacts = self.contacts
        contacts.mode[nodes] = STICKS
        contacts.v_target[nodes] += _aside(carried, contacts.normal[nodes])
        self.friction_impulse[nodes] = 0.0

    def _activate(self, leaving: np.ndarray, velocity: np.ndarray) -> int:
        """Activates nodes that `velocity` moves into an obstacle, except those just released; returns how many."""
        contacts, boundary = self.contacts, self.boundary
        if not len(boundary.radius):
            return 0
        self.nodes.v_star[:] = velocity
        contacts.mode[leaving] = HIDDEN
        unpushed = Push(self.nodes.gradient, 0.0)
        count = activate_entering(self.model, self.nodes, contacts, boundary, self.step, unpushed)
        contacts.mode[leaving] = FREE
        if boundary.rough:
            new = contacts.entering[:count].astype(np.int64)
            obstacle = contacts.contact_id[new].astype(np.int64) - 1
            rough = boundary.friction[obstacle] > 0.0
            self.meet(new[rough], boundary.velocity[self.step][obstacle[rough]])
        if len(boundary.radius) > 1:
            count += activate_edges(self.model, self.nodes, contacts, boundary, self.step, unpushed)
            self.friction_impulse[contacts.mode == ON_EDGE] = 0.0
        return count


def _nearer(boundary: BoundaryConditions, length: float) -> BoundaryConditions:
    """Planes moved by `length` [m] towards the body, round obstacles thicker by it."""
    position = boundary.position + np.where(boundary.is_plane[:, None], length * boundary.plane_normal, 0.0)
    return boundary._replace(position=position, radius=np.where(boundary.is_plane, 0.0, boundary.radius + length))


def _aside(vectors: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The part of vectors (c, 3) orthogonal to unit normals (c, 3)."""
    return vectors - np.einsum("ci,ci->c", vectors, normal)[:, None] * normal
