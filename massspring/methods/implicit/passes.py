"""One step of implicit springs: passes from the prediction to equilibrium of springs, volumes and obstacles (eq.
12.2–12.4)."""

import math

import numpy as np

from massspring.kernels.arrays.layout import Accuracy, BoundaryConditions, Push
from massspring.kernels.arrays.volume_rows import VolumeRows
from massspring.kernels.constraint.jacobian import rows_into, rows_times_into, transposed_rows_times_into
from massspring.kernels.forces.springs import spring_forces_into
from massspring.kernels.jit.stage_clock import HELD, MULTIPLIER, REVISION, SEARCH, SPRINGS, VOLUME
from massspring.kernels.step.end import add_held_impulse
from massspring.kernels.step.implicit_step import imbalance_into
from massspring.layout.jacobian_pattern import DENSE_UP_TO
from massspring.layout.state import State
from massspring.methods.implicit.contact import ActiveSet, Contact, LongStep
from massspring.methods.implicit.factor import Factor

CONTACT_REVISIONS, LAST_REVISIONS = 3, 12
"""Most revisions of the touched set in one pass, and in the last pass, after which no other pass corrects the set. The
last solution always belongs to the set that is applied."""
NEGLIGIBLE_RESPONSE = 1e-12
"""Share of its response without contact below which the response of a volume counts as round-off."""

SOFTNESS = 1e-10
"""Relative compliance added in a dense solve, so that S is regular if some volumes depend on others; the next pass
corrects the residual."""


class Step(LongStep):
    """A step of implicit springs."""

    def __init__(
        self, state: State, boundary: BoundaryConditions, step: int, factor: Factor, accuracy: Accuracy
    ) -> None:
        assert isinstance(state.rows, VolumeRows)  # start() made them
        super().__init__(state, boundary, step)
        self.rows, self.factor, self.accuracy = state.rows, factor, accuracy
        self.few = len(self.rows.lam) <= DENSE_UP_TO
        self.target = boundary.volume_target[step]
        """Targets of the volumes at the end of the step [m³], (m,); nearer to the current volumes if these are far
        off."""
        self.far_off = False
        """Whether the error of a volume is so large that only part of it is corrected."""
        self.idle = False
        """Whether a volume had no gradient."""
        self.contact = Contact(self.model, self.nodes, self.contacts, boundary, step)
        self.answers: np.ndarray | None = None

    def times(self, field: np.ndarray) -> np.ndarray:
        """J u [m³], (m,)."""
        product = np.empty(len(self.rows.lam))
        rows_times_into(self.rows, field, product)
        return product

    def pushed(self, pressure: np.ndarray) -> np.ndarray:
        """Jᵀ p [N], (n, 3)."""
        force = np.empty_like(self.p)
        transposed_rows_times_into(self.rows, pressure, force)
        return force

    def take(self, passes: int) -> None:
        """Makes `passes` passes; then v⁺ = (x⁺ − x)/dt."""
        rows_into(self.nodes.x, self.model.inverse_mass, self.rows)
        begun = self.rows.volume.copy()
        active, impulses = self.active_set(), np.zeros(0)
        obstacles = len(self.boundary.radius) > 0
        if obstacles:
            self.end_stage(SEARCH)
        for number in range(passes):
            if number > 0 and self.contact.apply_friction(self.p, active, impulses):
                active = self.active_set()
            free = self.factor.respond(self.imbalance())
            self.end_stage(SPRINGS)
            if number == 0 and self.few:
                self.answers = self.answers_of_all()
                self.reach(active)
                self.end_stage(VOLUME)
            if self.few:
                self.answer()
            if number == 0:
                self.cap(begun)
            most = CONTACT_REVISIONS if number + 1 < passes else LAST_REVISIONS
            change, impulses, active = self.revised(free, active, most if obstacles else 1)
            self.p += change
            self.rows.lam[:] += self.rows.search
            if self.far_off:
                break  # the pressure of a single linear step refers to J at its start, not to J at its end
        self.diagnostics.singular[0] += self.idle
        self.book(active, impulses)
        self.end_stage(HELD)
        self.end()

    def revised(self, free: np.ndarray, active: ActiveSet, most: int) -> tuple[np.ndarray, np.ndarray, ActiveSet]:
        """Change of the positions, contact impulses, and the active set of both, after at most `most` solves."""
        change, impulses = self.solve(free, active)
        self.end_stage(MULTIPLIER)
        for _ in range(most - 1):
            revised = self.contact.revise(self.p + change, active, impulses)
            active = self.active_set() if revised else active
            self.end_stage(REVISION)
            if not revised:
                break
            change, impulses = self.solve(free, active)
            self.end_stage(MULTIPLIER)
        return change, impulses, active

    def active_set(self) -> ActiveSet:
        """The current active set; also updates the response of volumes to their pressures with these contacts."""
        active = ActiveSet(self.factor, self.nodes, self.contacts, self.model.surface_nodes, self.boundary.dt)
        if self.answers is not None:
            self.reach(active)
            self.answer()
        return active

    def reach(self, active: ActiveSet) -> None:
        """dt² W̃ J_rᵀ [m/Pa], (m, n, 3)."""
        assert self.answers is not None
        self.reached = np.stack([active.without(answer) for answer in self.answers])

    def answer(self) -> None:
        """dt² J W̃ Jᵀ [m³/Pa] with J at p, (m, m)."""
        self.schur = np.column_stack([self.times(field) for field in self.reached])

    def cap(self, begun: np.ndarray) -> None:
        """Limits the correction in this step of volumes that are `begun` (m,) [m³] at its start, so that each by itself
        moves no node farther than 0.3 L (eq. 8.5)."""
        if self.few:
            gained, moved = np.diag(self.schur), np.linalg.norm(self.reached, axis=2).max(axis=1)
        else:
            gained, moved = self.factor.alone(self.rows)
        longest = self.model.correction_limit
        most = np.divide(longest * gained, moved, out=np.zeros_like(moved), where=moved > 0.0)
        error = self.target - begun
        cut = (np.abs(error) > most) & (most > 0.0)
        self.far_off = bool(cut.any())
        self.diagnostics.limited[0] += self.far_off
        self.target = np.where(cut, begun + np.clip(error, -most, most), self.target)

    def imbalance(self) -> np.ndarray:
        """Updates J and V at p; returns the right-hand side with the current pressures [kg m], (n, 3) (eq. 12.2)."""
        out = np.empty_like(self.p)
        imbalance_into(self.model, self.nodes, self.rows, self.p, self.boundary, out)
        return out

    def solve(self, free: np.ndarray, active: ActiveSet) -> tuple[np.ndarray, np.ndarray]:
        """(δ [m], contact impulses γ [kg m]) that end the pass at V0 and on the obstacles; `rows.search` is Δlam."""
        if self.boundary.rough:
            free = free + self.factor.respond(self.contact.friction_impulse)
        missing = active.place - active.along(self.p + free)
        change = free + active.moved_by(active.impulses(missing)) if len(missing) else free
        error = self.target - self.rows.volume - self.times(change)
        self.rows.search[:], answer = self.directly(error) if self.few else self.iteratively(error, active)
        reached = np.tensordot(self.rows.search, self.reached, 1) if self.few else active.without(answer)
        return change + reached, active.impulses(missing - active.along(answer))

    def directly(self, error: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(Δlam, dt² A⁻¹ Jᵀ Δlam) of few volumes by a dense solve (eq. 12.3)."""
        assert self.answers is not None
        able = np.diag(self.schur) > NEGLIGIBLE_RESPONSE * self.boundary.dt**2 * self.factor.alone(self.rows)[0]
        pressure = np.zeros(len(error))
        if able.any():
            inner = self.schur[np.ix_(able, able)]
            inner = inner + SOFTNESS * inner.diagonal().max() * np.eye(len(inner))
            pressure[able] = np.linalg.solve(inner, error[able])
        self.idle |= not able.all()
        return pressure, np.tensordot(pressure, self.answers, 1)

    def answers_of_all(self) -> np.ndarray:
        """dt² A⁻¹ J_rᵀ [m/Pa] before contact, a back-solve each, (m, n, 3).

        Computed once per step with J at the start of the passes; the next pass corrects for the change of Jᵀ.
        """
        units = np.eye(len(self.rows.lam))
        return self.boundary.dt**2 * np.stack([self.factor.respond(self.pushed(unit)) for unit in units])

    def iteratively(self, error: np.ndarray, active: ActiveSet) -> tuple[np.ndarray, np.ndarray]:
        """(Δlam, dt² A⁻¹ Jᵀ Δlam) of many volumes by conjugate gradients, one back-solve an iteration (eq. 8.4)."""
        diagonal = self.boundary.dt**2 * self.factor.alone(self.rows)[0]
        able = diagonal > 0.0
        self.idle |= not able.all()
        diagonal = np.where(able, diagonal, np.inf)
        allowed = np.where(able, self.accuracy.tolerance * self.boundary.volume_target[self.step], np.inf)
        pressure, answer, residual = np.zeros_like(error), np.zeros_like(self.p), error.copy()
        search, before, count = np.zeros_like(error), math.inf, 0
        while (np.abs(residual) > allowed).any() and count < self.accuracy.most_iterations:
            scaled = residual / diagonal
            rho = float(residual @ scaled)
            search = scaled + (rho / before if count else 0.0) * search
            response = self.boundary.dt**2 * self.factor.respond(self.pushed(search))
            image = self.times(active.without(response))
            step = rho / float(search @ image)
            pressure, answer, residual = pressure + step * search, answer + step * response, residual - step * image
            before, count = rho, count + 1
        self.count_passes(count)
        return pressure, answer

    def book(self, active: ActiveSet, impulses: np.ndarray) -> None:
        """Adds the impulses of obstacles and attachments [N s] (eq. 3.6)."""
        nodes, net, dt = self.nodes, self.model, self.boundary.dt
        self.contact.book(active, impulses, self.diagnostics.contact_impulse)
        spring_forces_into(self.p, net.ends, net.rest_length, net.stiffness, nodes.force)
        push = Push(self.pushed(self.rows.lam), 1.0)
        add_held_impulse(net, nodes, push, dt, self.boundary.gravity, self.diagnostics.held_impulse)
