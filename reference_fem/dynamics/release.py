"""The start of a motion: accelerations consistent with a displacement and a velocity (docs/theory.md, eq. 6.11)."""

from dataclasses import replace

import numpy as np

from reference_fem.dynamics.inertia import Motion, MovingSystem
from reference_fem.statics.tangent import Tangent
from reference_fem.system.state import State


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
