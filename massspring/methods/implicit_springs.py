"""Implicit springs by local/global steps with a matrix factored once: for stiff bodies and long steps.

Backward Euler, M (1 + c dt) v⁺ = M v + dt (f(x⁺) + Jᵀ lam + m g), V(x⁺) = V0, obstacles as constraints. Liu, Bargteil,
O'Brien, Kavan (2013): with springs at their full stiffness in every direction the matrix A of `factor` is constant and
its quadratic model bounds the energy of the springs from above, so that passes

    A δ = M dt v + dt² (f(p) + m g) − (1 + c dt) M (p − x) + dt² Jᵀ lam + Cᵀ γ,   p ← p + δ

descend whatever the step is. Volumes are linearised at p and cost a back-solve each, Y = A⁻¹ Jᵀ; contact is eliminated
with the columns of A⁻¹ at touched nodes, so that W̃ = A⁻¹ − A⁻¹ Cᵀ (C A⁻¹ Cᵀ)⁻¹ C A⁻¹ stands where W̃ stands in HCJ05.

Limits: no step is unstable, but long ones lose energy, and few passes slow down turning; Python once per pass.
"""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from massspring.body import Body
from massspring.errors import MassSpringError
from massspring.kernels.implicit_contact import seat_entering
from massspring.kernels.layout import Drive
from massspring.kernels.motion import add_held_impulse
from massspring.kernels.rows import (
    rows_into,
    rows_times_into,
    transposed_rows_times_into,
    volumes_of_rows_into,
)
from massspring.kernels.rubbing import wedge
from massspring.kernels.springs import spring_forces_into
from massspring.methods.base import Method, State, begin_frame, start
from massspring.methods.factor import Factor, Factors, Touching
from massspring.methods.rows import DENSE_UP_TO, volume_rows
from massspring.obstacles import Attachment

CONTACT_REVISIONS = 3
"""Of the touched set in one pass; the last solution always belongs to the set that is applied."""
NEGLIGIBLE = 1e-12
"""Contact and held nodes that leave a volume this little of its response leave nothing but round-off."""

SOFTNESS = 1e-10
"""Relative compliance of volumes that are solved for densely: where some depend on others S stays regular; the next
pass sees what it leaves."""


class Step:
    """One step in the making; arrays of the state are its scratch."""

    def __init__(self, method: "ImplicitSprings", state: State, drive: Drive, step: int, factor: Factor) -> None:
        assert state.rows is not None  # start() made them
        self.method, self.drive, self.step, self.factor = method, drive, step, factor
        self.network, self.motion, self.rows, self.tally = state.network, state.motion, state.rows, state.tally
        self.dt = drive.dt
        mass = self.network.mass[:, None]
        self.inertia = mass * (self.dt * self.motion.v + self.dt**2 * drive.gravity)
        self.heavy = (1.0 + drive.damping * self.dt) * mass
        # Without gravity: passes that start from balance must stay there, or a sum of few would be biased.
        self.p = self.motion.x + self.dt * self.motion.v
        held = self.network.held_nodes
        self.p[held] = self.network.held_rest + drive.held_displacement[step][self.network.held_group]
        self.motion.locked[self.network.surface_nodes] = 0
        self.motion.touched[self.network.surface_nodes] = 0

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

    def take(self) -> None:
        """All passes; then v⁺ = (x⁺ − x)/dt."""
        touching = Touching(self.factor, self.motion, self.network.surface_nodes, self.dt)
        impulses = np.zeros(0)
        for _ in range(self.method.passes):
            residual = self.linearise()
            free = self.factor.respond(residual)
            self.answers = self.answers_of_all()
            for revision in range(CONTACT_REVISIONS):
                change, impulses = self.solve(free, touching)
                if revision + 1 == CONTACT_REVISIONS or not self.revise(self.p + change, touching, impulses):
                    break
                touching = Touching(self.factor, self.motion, self.network.surface_nodes, self.dt)
            self.p = self.p + change
            self.rows.lam[:] += self.rows.search
        self.book(touching, impulses)
        self.motion.v[:] = (self.p - self.motion.x) / self.dt
        self.motion.x[:] = self.p

    def linearise(self) -> np.ndarray:
        """J, V at p, and the right-hand side for the pressures of the moment [kg m], (n, 3) (eq. 92)."""
        net, force = self.network, self.motion.force
        spring_forces_into(self.p, net.ends, net.rest_length, net.stiffness, force)
        rows_into(self.p, self.rows)
        volumes_of_rows_into(self.p, self.rows, self.rows.volume)
        known = self.dt**2 * (force + self.pushed(self.rows.lam))
        return self.inertia + known - self.heavy * (self.p - self.motion.x)

    def solve(self, free: np.ndarray, touching: Touching) -> tuple[np.ndarray, np.ndarray]:
        """(δ [m], contact impulses γ [kg m]) that end the pass at V0 and on the obstacles; `rows.search` is Δlam."""
        missing = touching.place - touching.along(self.p)
        change = touching.without(free)
        if len(missing):
            change = change + touching.moved_by(touching.impulses(missing))
        error = self.drive.volume_target[self.step] - self.rows.volume - self.times(change)
        few = len(error) <= DENSE_UP_TO
        self.rows.search[:], answer = (self.directly if few else self.iteratively)(error, touching)
        change = change + touching.without(answer)
        impulses = touching.impulses(missing - touching.along(free + answer)) if len(missing) else missing
        return change, impulses

    def directly(self, error: np.ndarray, touching: Touching) -> tuple[np.ndarray, np.ndarray]:
        """(Δlam, dt² A⁻¹ Jᵀ Δlam) of few volumes by a dense solve (eq. 93)."""
        reached = np.stack([touching.without(answer) for answer in self.answers])
        schur = np.column_stack([self.times(field) for field in reached])
        able = np.diag(schur) > NEGLIGIBLE * self.response_alone()
        pressure = np.zeros(len(error))
        if able.any():
            inner = schur[np.ix_(able, able)]
            inner = inner + SOFTNESS * inner.diagonal().max() * np.eye(len(inner))
            pressure[able] = np.linalg.solve(inner, error[able])
        self.tally.skipped[0] += not able.all()
        return pressure, np.tensordot(pressure, self.answers, 1)

    def answers_of_all(self) -> np.ndarray:
        """dt² A⁻¹ J_rᵀ [m/Pa] before contact, one back-solve of three columns each, (m, n, 3)."""
        m, n = len(self.rows.lam), len(self.p)
        if m > DENSE_UP_TO:
            return np.empty((0, n, 3))
        units = np.stack([self.pushed(unit) for unit in np.eye(m)], axis=1)
        return self.dt**2 * self.factor.respond(units.reshape(n, 3 * m)).reshape(n, m, 3).swapaxes(0, 1)

    def response_alone(self) -> np.ndarray:
        """dt² Σ_j |J_rj|²/A_jj [m³/Pa], (m,): how far a volume answers its pressure where each node is alone."""
        each = (self.rows.value**2).sum(axis=1) / self.factor.diagonal[self.rows.column]
        return self.dt**2 * np.add.reduceat(each, self.rows.row_start[:-1].astype(np.int64))

    def iteratively(self, error: np.ndarray, touching: Touching) -> tuple[np.ndarray, np.ndarray]:
        """(Δlam, dt² A⁻¹ Jᵀ Δlam) of many volumes by conjugate gradients, one back-solve an iteration (eq. 34)."""
        allowed = self.method.tolerance * self.drive.volume_target[self.step]
        diagonal = self.response_alone()
        pressure, answer, residual = np.zeros_like(error), np.zeros_like(self.p), error.copy()
        search, before, count = np.zeros_like(error), math.inf, 0
        while (np.abs(residual) > allowed).any() and count < self.method.most_iterations:
            scaled = residual / diagonal
            rho = float(residual @ scaled)
            search = scaled + (rho / before if count else 0.0) * search
            response = self.factor.respond(self.dt**2 * self.pushed(search))
            image = self.times(touching.without(response))
            step = rho / float(search @ image)
            pressure, answer, residual = pressure + step * search, answer + step * response, residual - step * image
            before, count = rho, count + 1
        self.tally.iterations[0] += count
        self.tally.iterations[1] = max(int(self.tally.iterations[1]), count)
        return pressure, answer

    def revise(self, end: np.ndarray, touching: Touching, impulses: np.ndarray) -> bool:
        """Releases nodes that an obstacle would pull, seats those that would enter one; whether any was (eq. 13)."""
        if not len(self.drive.radius):
            return False
        motion = self.motion
        motion.v_star[:] = (end - motion.x) / self.dt
        nodes, sticks = touching.nodes, motion.locked[touching.nodes] == 3
        inward = np.einsum("ci,ci->c", touching.direction, motion.normal[nodes]) * impulses
        stuck = np.bincount(nodes, weights=np.where(sticks, inward, 0.0), minlength=len(end))
        leaving = np.unique(nodes[np.where(sticks, stuck[nodes], impulses) < 0.0])
        motion.locked[leaving], motion.touched[leaving] = 0, 0
        entered = self.seat(leaving)
        return bool(len(leaving) or entered)

    def seat(self, leaving: np.ndarray) -> int:
        """Seats nodes that would enter an obstacle, but for those just let go; how many."""
        motion, drive = self.motion, self.drive
        motion.locked[leaving] = 4  # out of sight
        count = seat_entering(self.network, motion, drive, self.step)
        motion.locked[leaving] = 0
        if drive.rough:
            new = motion.entering[:count].astype(np.int64)
            obstacle = motion.touched[new].astype(np.int64) - 1
            rough = np.isinf(drive.friction[obstacle])
            new, carried = new[rough], drive.velocity[self.step][obstacle[rough]]
            along = np.einsum("ci,ci->c", motion.normal[new], carried)[:, None] * motion.normal[new]
            motion.locked[new] = 3
            motion.goal[new] += carried - along
        if len(drive.radius) > 1:
            count += wedge(self.network, motion, drive, self.step, 0.0)
        return count

    def book(self, touching: Touching, impulses: np.ndarray) -> None:
        """Impulses of obstacles and attachments [N s] (eq. 11)."""
        motion, net = self.motion, self.network
        np.add.at(self.tally.contact_impulse, touching.obstacle, impulses[:, None] / self.dt * touching.direction)
        spring_forces_into(self.p, net.ends, net.rest_length, net.stiffness, motion.force)
        motion.gradient[:] = self.pushed(self.rows.lam)
        add_held_impulse(net, motion, 1.0, self.dt, self.drive.gravity, self.tally.held_impulse)


@dataclass(frozen=True)
class ImplicitSprings(Method):
    """Backward Euler by local/global passes (Liu et al. 2013), volumes and contact inside (HCJ05's constraint)."""

    passes: int = 10
    """Local/global passes a step."""
    tolerance: float = 1e-6
    """Volume error that an iterative solve may leave, over the volume [1]."""
    most_iterations: int = 200

    name: ClassVar[str] = "implicit_springs"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = 1e-6
    keeps_spin: ClassVar[bool] = False
    holds_apart: ClassVar[bool] = True
    limited: ClassVar[bool] = False

    def applies(self, body: Body) -> str | None:
        """Triangle springs harden without bound: no constant matrix lies above them."""
        return "its constant matrix knows no triangle springs; take implicit_volume" if len(body.membrane[0]) else None

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s], and no matrix factored yet."""
        state = start(body, attachments, v)
        rows = volume_rows(body.kept, body.node_count) if state.rows is None else state.rows
        return replace(state, rows=rows, memory=Factors())

    def advance(self, state: State, drive: Drive) -> State:
        """One frame. Raises MassSpringError for Coulomb friction."""
        slippery = (drive.friction > 0.0) & np.isfinite(drive.friction)
        if slippery.any():
            raise MassSpringError(
                f"method 'implicit_springs' takes friction 0 or 'no_slip', obstacle {int(np.argmax(slippery))} has "
                f"{drive.friction[slippery][0]:g}; take implicit_volume"
            )
        after = begin_frame(state, drive)
        assert after.rows is not None  # start() made them
        after.rows.lam[:] = after.lam + after.network.rest_lam
        factor = after.memory.at(after.network, drive.dt, drive.damping)
        for step in range(len(drive.position)):
            Step(self, after, drive, step, factor).take()
        return replace(after, lam=after.rows.lam - after.network.rest_lam)
