"""The discrete system of a body in motion: generalised-alpha for the displacement, everything else at the step's end.

Arnold and Brüls, Convergence of the generalized-alpha scheme for constrained mechanical systems, Multibody System
Dynamics 18, 2007, with the parameters of Chung and Hulbert, Journal of Applied Mechanics 60, 1993. The momentum
balance M a + c M v + f(u, p) = load, the pressure's constraint and contact all hold exactly at the end of the step;
only the auxiliary acceleration that feeds Newmark's formulas is averaged (docs/theory.md, eqs. 6.9 and 6.10). If the
pressure were averaged too, its error would persist from step to step, since nothing damps a multiplier.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from reference_fem.dynamics.mass import build_mass
from reference_fem.model.problem import Problem
from reference_fem.system.checks import check_inertia
from reference_fem.system.saddle_point import Evaluation, System
from reference_fem.system.state import Loads, NewtonSettings, State


class Scheme(NamedTuple):
    """Parameters of generalised-alpha; second order for every rho_inf, which sets the damping of frequencies that the
    step cannot resolve."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float


def scheme(rho_inf: float) -> Scheme:
    """Optimal parameters for a spectral radius rho_inf at infinite frequency (Chung and Hulbert 1993, eqs 17-25)."""
    alpha_m, alpha_f = (2.0 * rho_inf - 1.0) / (rho_inf + 1.0), rho_inf / (rho_inf + 1.0)
    lead = alpha_f - alpha_m
    return Scheme(alpha_m, alpha_f, 0.25 * (1.0 + lead) ** 2, 0.5 + lead)


@dataclass
class Motion:
    """A State with its velocity and accelerations, interleaved like u, each (3 N2,)."""

    state: State
    v: np.ndarray
    """[m/s]."""
    a: np.ndarray
    """Acceleration [m/s²]."""
    memory: np.ndarray
    """The scheme's auxiliary acceleration, a second-order guess of a a little before t [m/s²]."""


@dataclass
class TimeStep:
    """Velocity and acceleration at the end of a step dt [s] as functions of the displacement there."""

    old: Motion
    dt: float
    scheme: Scheme
    held: np.ndarray
    """Unknowns whose motion is prescribed. They follow it exactly: by Newmark's formulas they would oscillate after a
    kink."""
    held_v: np.ndarray
    held_a: np.ndarray

    def at(self, u: np.ndarray):
        """(v, a, memory) for u (3 N2,): Newmark's formulas and (1 - am) m1 + am m0 = (1 - af) a1 + af a0 (eq. 6.10)."""
        alpha_m, alpha_f, beta, gamma = self.scheme
        old, dt = self.old, self.dt
        moved = u - old.state.x[: len(u)] - dt * old.v
        memory = moved / (beta * dt**2) - (0.5 / beta - 1.0) * old.memory
        v = old.v + dt * ((1.0 - gamma) * old.memory + gamma * memory)
        a = ((1.0 - alpha_m) * memory + alpha_m * old.memory - alpha_f * old.a) / (1.0 - alpha_f)
        v[self.held], a[self.held], memory[self.held] = self.held_v, self.held_a, self.held_a
        return v, a, memory

    def slopes(self):
        """(dv/du [1/s], da/du [1/s²]) of an unknown that is free."""
        alpha_m, alpha_f, beta, gamma = self.scheme
        return gamma / (beta * self.dt), (1.0 - alpha_m) / ((1.0 - alpha_f) * beta * self.dt**2)


@dataclass
class Instant:
    """A given instant of a motion, in place of a TimeStep."""

    motion: Motion

    def at(self, _: np.ndarray):
        """(v, a, memory) of the instant, independent of the displacement."""
        return self.motion.v, self.motion.a, self.motion.memory

    def slopes(self):
        """dv/du and da/du: none."""
        return 0.0, 0.0


class MovingSystem(System):
    """A System with inertia and the damping force -c M v; the body may be free to move as a whole.

    damping: c [1/s]. `clock` gives velocity and acceleration to a displacement; without one the body is at rest.
    Raises SolveError for a body without mass.
    """

    def __init__(self, problem: Problem, settings: NewtonSettings, damping: float = 0.0):
        check_inertia(problem)
        super().__init__(problem, settings)
        self.mass = build_mass(self)
        self.damping = damping
        self.clock: TimeStep | Instant | None = None

    def check_freedom(self, held_dofs: np.ndarray):
        """Accepts any holders: inertia balances forces that no holder does."""

    def evaluate(self, x: np.ndarray, loads: Loads, tangent: bool = True) -> Evaluation:
        """As System.evaluate, with inertia if there is a clock."""
        evaluation = super().evaluate(x, loads, tangent)
        if self.clock is None:
            return evaluation
        n, count = self.displacement_count, len(self.pattern.indices)
        v, a, _ = self.clock.at(x[:n])
        inertia = self.inertia(a + self.damping * v)
        evaluation.residual[:n] += inertia
        if tangent:
            by_v, by_a = self.clock.slopes()
            # not the columns of prescribed unknowns: their acceleration is given
            evaluation.values[:count] += (by_a + self.damping * by_v) * self.mass.values[:count]
        evaluation.errors[0] = self.force_error(evaluation, inertia, v, loads.force)
        return evaluation

    def inertia(self, field: np.ndarray):
        """Mass times a nodal field, interleaved (3 N2,)."""
        return self.mass.times(field.reshape(-1, 3)).ravel()

    def force_error(self, evaluation: Evaluation, inertia: np.ndarray, v: np.ndarray, force: np.ndarray | float):
        """Unbalanced force over the forces at work.

        If no force acts, as in free flight, the scale is the elastic force that would stop the motion.
        """
        free = self.pattern.free[self.pattern.free < self.displacement_count]
        mu, size = self.problem.material.mu, self.volume ** (1.0 / 3.0)
        stop = np.linalg.norm(self.inertia(v)) * np.sqrt(mu / self.problem.density) / size
        held = np.linalg.norm(evaluation.residual[self.pattern.held])
        pushed = np.abs(evaluation.touch.force).sum()
        sizes = (held, pushed, np.linalg.norm(force), np.linalg.norm(inertia), stop, 1e-9 * mu * size**2)
        return np.linalg.norm(evaluation.residual[free]) / max(sizes)
