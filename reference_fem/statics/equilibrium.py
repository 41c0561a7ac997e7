"""Loading paths: equilibria at given times, with sub-steps that shrink after failures and grow again."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from reference_fem.contact import augmented as contact
from reference_fem.contact.faces import farthest_slip, overlap
from reference_fem.errors import SolveError
from reference_fem.model.problem import Problem
from reference_fem.statics.newton import StepFailed, solve_step
from reference_fem.system import assembly
from reference_fem.system.checks import check_times
from reference_fem.system.saddle_point import System
from reference_fem.system.state import NewtonSettings, State

EASY = 8
"""Newton iterations below which the next sub-step may be twice as long."""


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """One state of rest under load; SI units, N2 P2 nodes, N1 vertices."""

    t: float
    u: np.ndarray
    """Displacement of the P2 nodes, (N2, 3) [m]."""
    p: np.ndarray
    """Pressure at the vertices, positive in tension, (N1,) [Pa]."""
    obstacle_force: np.ndarray
    """Force of each obstacle on the body, (no, 3) [N], from the contact pressures."""
    held_force: np.ndarray
    """Force of each held region on the body, (nh, 3) [N]; a shared unknown counts for the first region."""
    reaction: np.ndarray
    """Force of the holders on each node, (N2, 3) [N]."""
    volume: float
    volume0: float
    J: np.ndarray
    """Volume ratio at the quadrature points, (ne, nq)."""
    weights: np.ndarray
    """Rest volume of the quadrature points, (ne, nq) [m³]."""
    penetration: float
    """Deepest quadrature point inside an obstacle, or on a cut in the other face [m]."""
    slippage: float
    """Farthest that a point stuck to a no-slip obstacle has slipped [m]."""
    newton_iterations: int
    """Linear solves since the previous wanted time, failed sub-steps not counted."""
    substeps: int
    energy: float
    """Strain energy [J]."""
    cavity_pressure: np.ndarray
    """Gauge pressure in each lumen, positive when it pushes the wall out, (nc,) [Pa]."""
    cavity_volume: np.ndarray
    """Volume of each lumen, (nc,) [m³]."""

    @property
    def min_J(self):
        """Smallest J of all quadrature points."""
        return float(self.J.min())

    @property
    def max_J(self):
        """Largest J of all quadrature points."""
        return float(self.J.max())


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """An interrupted path: the results at its first times, and the state from which the next load step starts."""

    path: list[Equilibrium]
    state: State


def equilibrium_path(
    problem: Problem,
    times: ArrayLike,
    settings: NewtonSettings | None = None,
    on_step: Callable[[Equilibrium], None] | None = None,
    on_checkpoint: Callable[[Checkpoint], None] | None = None,
) -> list[Equilibrium]:
    """Equilibria at the given times [s], reached from rest at settings.start. on_step is called with each as it is
    found.

    on_checkpoint is called with each and its unknowns.
    Dead loads and cavities that start filled are applied first, at the start time. Raises SolveError for a problem
    that cannot be set up, and when a sub-step below settings.smallest_step still fails: then its `converged` holds
    what was reached.
    """
    settings = settings or NewtonSettings()
    times = check_times(times, settings.start)
    system = System(problem, settings)
    path: list[Equilibrium] = []
    try:
        state, pending = system.rest(), (0, 0)
        if system.starts_loaded():
            state, *pending = advance(system, state, settings.start, 1.0, path)
        for t in times:
            state, iterations, substeps = advance(system, state, t, 1.0, path)
            path.append(describe(system, state, iterations + pending[0], substeps + pending[1]))
            pending = (0, 0)
            if on_step is not None:
                on_step(path[-1])
            if on_checkpoint is not None:
                on_checkpoint(Checkpoint(list(path), state))
    finally:
        system.solver.release()
    return path


def advance(system: System, state: State, t: float, load: float, path: Sequence[Equilibrium]):
    """(state at time t and gravity share load, iterations, sub-steps), in as many sub-steps as it takes."""
    t0, load0, reached, share = state.t, state.load, 0.0, 1.0
    iterations = substeps = 0
    while reached < 1.0:
        goal = min(1.0, reached + share)
        there = t if goal == 1.0 else t0 + goal * (t - t0)
        try:
            state = solve_step(system, state, there, load0 + goal * (load - load0))
        except StepFailed as failure:
            share = 0.5 * (goal - reached)
            if share < system.settings.smallest_step:
                raise stuck(state, t, failure, path) from failure
            continue
        iterations, substeps, reached = iterations + state.iterations, substeps + 1, goal
        if state.iterations <= EASY:
            share *= 2.0
    return state, iterations, substeps


def stuck(state: State, t: float, failure: Exception, path: Sequence[Equilibrium]):
    gravity = f" under {100 * state.load:.3g} % of what acts at the start" if state.load < 1.0 else ""
    return SolveError(
        f"no equilibrium found between t = {state.t:g} s{gravity} (the last that converged) and t = {t:g} s: "
        f"{failure}; refine the mesh where it folds, or ask for less",
        converged=path,
    )


def describe(system: System, state: State, iterations: int, substeps: int) -> Equilibrium:
    n, elements = system.displacement_count, system.elements
    evaluation = system.evaluate(state.x, system.loads_of(state), tangent=False)
    slip = farthest_slip(state.x, system.faces, evaluation.faces)
    if slip > 1.0:
        raise SolveError(
            f"faces of the cut that touch have slid over each other by {slip:.2g} facets at t = {state.t:g} s, and"
            " points find each other within one: press them with less shear, or take a coarser mesh"
        )
    J = np.linalg.det(assembly.deformation(state.x, elements)[0])
    reaction, held = np.zeros(n), system.pattern.held
    reaction[held] = evaluation.residual[held]
    for lumen, pressure in zip(system.lumens, state.x[system.field_count :], strict=True):
        reaction[held] += pressure * lumen.beyond_pressure(state.x[: system.field_count])[held]
    return Equilibrium(
        t=float(state.t),
        u=state.x[:n].reshape(-1, 3).copy(),
        p=state.x[n : system.field_count].copy(),
        obstacle_force=evaluation.touch.force,
        held_force=held_forces(system, reaction),
        reaction=reaction.reshape(-1, 3),
        volume=float(np.sum(elements.weights * J)),
        volume0=system.volume,
        J=J,
        weights=elements.weights,
        penetration=max(contact.penetration(evaluation.touch), overlap(evaluation.faces)),
        slippage=contact.slippage(evaluation.touch),
        newton_iterations=iterations,
        substeps=substeps,
        energy=assembly.energy(state.x, elements, system.problem.material),
        cavity_pressure=state.x[system.field_count :].copy(),
        cavity_volume=evaluation.volumes,
    )


def held_forces(system: System, reaction: np.ndarray):
    """Sum of the reactions of each held region, (nh, 3) [N]."""
    left, forces = reaction.copy(), np.zeros((len(system.held), 3))
    for k, held in enumerate(system.held):
        for component, dofs in zip(held.components, held.dofs, strict=True):
            forces[k, component] = left[dofs].sum()
            left[dofs] = 0.0
    return forces
