"""Time integration: failed steps are halved and steps then grow again; an account of the energy is kept.

docs/theory.md, eqs. 6.11 and 6.12.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from reference_fem.dynamics.inertia import Instant, Motion, MovingSystem, Scheme, TimeStep
from reference_fem.errors import SolveError
from reference_fem.statics.equilibrium import EASY, Equilibrium
from reference_fem.statics.newton import StepFailed, solve_step
from reference_fem.statics.tangent import Tangent
from reference_fem.system import assembly
from reference_fem.system.state import State


class Powers(NamedTuple):
    """The quantities of the energy account at one instant."""

    force: np.ndarray
    """Dead loads and weight, (field_count,) [N]."""
    obstacles: np.ndarray
    """Their positions, (no, 3) [m]."""
    push: np.ndarray
    """Their forces on the body, (no, 3) [N]."""
    reaction: np.ndarray
    """Forces of the holders, one for each held unknown [N]."""
    pressures: np.ndarray
    """Pressures in the cavities, (nc,) [Pa]."""
    volumes: np.ndarray
    """Volumes of the cavities, (nc,) [m³]."""
    dissipation: float
    """c v·M v [W]."""


class Account:
    """Work and damping since the start, by the trapezoidal rule between the ends of the steps."""

    def __init__(self, system: MovingSystem, motion: Motion):
        self.system, self.damped, self.work = system, 0.0, 0.0
        self.now = self.powers(motion)

    def powers(self, motion: Motion) -> Powers:
        system, state = self.system, motion.state
        loads = system.loads_of(state)
        evaluation = system.evaluate(state.x, loads, tangent=False)
        dissipation = 2.0 * system.damping * kinetic(system, motion)
        rows = loads.rows[:, 1:4]
        reaction, pressures = evaluation.residual[system.pattern.held], state.x[system.field_count :]
        push = evaluation.touch.force
        return Powers(np.asarray(loads.force), rows, push, reaction, pressures, evaluation.volumes, dissipation)

    def book(self, old: Motion, new: Motion):
        system, before, now = self.system, self.now, self.powers(new)
        moved = new.state.x - old.state.x
        n, held = system.displacement_count, system.pattern.held
        self.work += 0.5 * (before.force + now.force)[:n] @ moved[:n]
        self.work += 0.5 * np.sum((before.push + now.push) * (now.obstacles - before.obstacles))
        self.work += 0.5 * (before.reaction + now.reaction) @ moved[held]
        self.work += 0.5 * (before.pressures + now.pressures) @ (now.volumes - before.volumes)
        self.damped += 0.5 * (before.dissipation + now.dissipation) * (new.state.t - old.state.t)
        self.now = now


def kinetic(system: MovingSystem, motion: Motion):
    """v·M v / 2 [J]."""
    return 0.5 * float(motion.v @ system.inertia(motion.v))


def strain(system: MovingSystem, state: State):
    """Strain energy [J]."""
    return assembly.energy(state.x, system.elements, system.problem.material)


class March:
    """A motion during its integration."""

    def __init__(self, system: MovingSystem, scheme: Scheme, dt: float | None = None):
        self.system, self.scheme, self.dt = system, scheme, dt
        self.iterations = self.substeps = 0

    def begin(self, state: State, v: np.ndarray, interval: float):
        """Releases a body in `state` with velocities v; interval [s]: time to the first wanted time."""
        system = self.system
        self.motion = released(system, state, v, interval / self.count(interval))
        system.clock = Instant(self.motion)
        self.account = Account(system, self.motion)
        # with the pressure as given: the multiplier that starts the motion stores no energy
        self.energy0 = kinetic(system, self.motion) + strain(system, state)

    def count(self, interval: float):
        """Equal steps that an interval takes; 1e-9 is round-off in an interval that is a multiple of dt."""
        return 1 if self.dt is None else max(1, int(np.ceil(interval / self.dt * (1.0 - 1e-9))))

    def advance(self, t: float, path: Sequence[Equilibrium]):
        """To time t, in as many steps as it takes; `path` goes into the exception when they fail."""
        t0, reached = self.motion.state.t, 0.0
        share = full = 1.0 / self.count(t - t0)
        while reached < 1.0:
            # no separate step for a remainder that is round-off
            goal = 1.0 if reached + 1.001 * share > 1.0 else reached + share
            try:
                self.step(t if goal == 1.0 else t0 + goal * (t - t0))
            except StepFailed as failure:
                share = 0.5 * (goal - reached)
                if share < self.system.settings.smallest_step * full:
                    raise self.stuck(t, failure, path) from failure
                continue
            reached = goal
            if self.motion.state.iterations <= EASY:
                share = min(full, 2.0 * share)

    def step(self, t: float):
        """One step, to time t; after StepFailed the motion is unchanged."""
        system, old = self.system, self.motion
        dt = t - old.state.t
        system.clock = TimeStep(old, dt, self.scheme, system.pattern.held, *held_motion(system, t, dt))
        state = solve_step(system, old.state, t, 1.0)
        self.motion = Motion(state, *system.clock.at(state.x[: system.displacement_count]))
        system.clock = Instant(self.motion)
        self.account.book(old, self.motion)
        self.iterations, self.substeps = self.iterations + state.iterations, self.substeps + 1

    def stuck(self, t: float, failure: Exception, path: Sequence[Equilibrium]):
        return SolveError(
            f"no motion found between t = {self.motion.state.t:g} s (the last that converged) and t = {t:g} s: "
            f"{failure}; refine the mesh where it folds, or ask for less",
            converged=path,
        )


def held_motion(system: MovingSystem, t: float, dt: float):
    """Velocity and acceleration of the prescribed unknowns at time t, by differences of the second order.

    Central; forward while t - dt lies before the start, where a motion need not be defined.
    """
    if t - dt < system.settings.start:
        now, one, two, three = (system.held_at(t + k * dt) for k in range(4))
        return (-3.0 * now + 4.0 * one - two) / (2.0 * dt), (2.0 * now - 5.0 * one + 4.0 * two - three) / dt**2
    before, now, after = (system.held_at(t + k * dt) for k in (-1, 0, 1))
    return (after - before) / (2.0 * dt), (after - 2.0 * now + before) / dt**2


def released(system: MovingSystem, state: State, v: np.ndarray, dt: float) -> Motion:
    """The motion that starts from the displacement in `state` with velocities v (3 N2,).

    M a + B p = load - f(u, 0) - c M v and B·a - 2 C p / dt² = -(g(u + dt v) + g(u - dt v)) / dt², with the tangent's
    blocks B and -C and the volume misfit g at p = 0: the pressure is the one that leaves J - 1 = p/kappa true after a
    step of constant acceleration. For a soft bulk that is the elastic pressure, for a stiff one the multiplier of the
    hidden constraint d²J/dt² = 0; any other start would ring from step to step.
    """
    n, held = system.displacement_count, system.pattern.held
    v = v.copy()
    v[held], held_a = held_motion(system, state.t, dt)
    x = np.concatenate((state.x[:n], np.zeros(system.total - n)))
    loads = system.loads_of(replace(state, load=1.0, x=x))
    for k, lumen in enumerate(system.lumens):
        if lumen.by_pressure:
            x[system.field_count + k] = loads.filling[k]
    evaluation = system.evaluate(x, loads)
    evaluation.residual[:n] += system.damping * system.inertia(v)
    evaluation.residual[n:] = 0.0
    for sign in (1.0, -1.0):
        y = x.copy()
        y[:n] += sign * dt * v
        evaluation.residual[n:] += system.evaluate(y, loads, tangent=False).residual[n:] / dt**2
    put_mass(system, evaluation.values, dt)
    solution = Tangent(system, evaluation).newton(held_a)
    x[n:] += solution[n:]
    return Motion(
        replace(state, load=1.0, x=x),
        v,
        solution[:n],
        solution[:n].copy(),
    )


def put_mass(system: MovingSystem, values: np.ndarray, dt: float):
    """Tangent values with the mass in place of the stiffness, and the compressibility over dt²/2, in place."""
    pattern, n = system.pattern, system.displacement_count
    count, displaced = len(pattern.indices), pattern.free < n
    rows = np.repeat(np.arange(len(pattern.free)), np.diff(pattern.indptr))
    lifted = np.repeat(np.arange(len(pattern.free)), np.diff(pattern.lift_indptr))
    stiff = np.concatenate((displaced[rows] & displaced[pattern.indices], displaced[lifted], [False]))
    values[stiff] = system.mass.values[stiff]
    values[:count][~displaced[rows]] *= 2.0 / dt**2
