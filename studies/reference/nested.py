"""A reference on nested meshes: each solution starts from that of the coarser mesh, and says where to refine next."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from reference_fem import Equilibrium, NewtonSettings, Problem, SolveError, equilibrium_path, nodes
from reference_fem.estimate import stress_indicator
from reference_fem.statics.equilibrium import advance, describe
from reference_fem.statics.nested import carried, continued, transfer
from reference_fem.statics.newton import StepFailed
from reference_fem.system.saddle_point import System
from reference_fem.system.state import State
from reference_fem.uncertainty import MeshError
from studies.meshing.nested_mesh import NestedMesh, at_nodes, base_mesh
from studies.reference.problem import problem_on
from studies.reference.reference_solves import settings_varied
from studies.reference.sample import Sample, SamplePoints, sample_of
from studies.reference.uncertainty import uncertainty_of_meshes
from studies.scene.quantities import allowed
from studies.scene.scene import Scene

GROWTH = 2.5
"""Unknowns of a mesh over those of the one before, at most: more, and its indicator knows too little of the next."""
LOOSE = NewtonSettings(force_tol=1e-4, penetration_tol=1e-3)
"""Between the coarsest and the finest mesh: forces differ by 1e-4 from those of the usual tolerances, in half the
time."""
DISPLACEMENT = 2.5
"""Bar of the mean displacement that weighs as much as one of the force: it falls faster, so less is allowed."""


class MeshSolution(NamedTuple):
    """One mesh, solved at the last checkpoint."""

    mesh: NestedMesh
    system: System
    state: State


@dataclass(frozen=True, eq=False)
class FamilySolution:
    """What the solutions of a scene's meshes give, and how the finest was reached."""

    problem: Problem
    """Of the finest mesh that was solved."""
    equilibria: Sequence[Equilibrium]
    """At the scene's checkpoints; fewer where the path broke off."""
    at: SamplePoints
    samples: Sequence[Sample]
    """Of the meshes, fine to coarse, then of the refined settings."""
    off: int = 0
    """Boundary nodes of the finest mesh that are not on the true shape."""
    stopped: str = ""
    """Why refinement ended before the plan's tolerance, "" where it did not."""
    failure: str = ""
    """Why there is no reference, "" where there is one."""


Varied = Callable[[Problem, tuple[float, ...], NewtonSettings], tuple[Problem, tuple[float, ...], NewtonSettings]]


def solve_nested(scene: Scene, variants: Mapping[str, Varied]) -> FamilySolution:
    """The scene on its nested meshes, the coarsest also with each of the settings made better that its plan names.

    Raises StudyError for a mesh that cannot be made.
    """
    plan, times = scene.reference, scene.checkpoints
    assert plan is not None  # the scene has a reference
    base = base_mesh(scene, plan.base, plan.at_contact)
    problem, states = problem_of(base), list[State]()
    at = SamplePoints(nodes(base.mesh)[: base.mesh.nvertices], base.mesh.t[:4].T.astype(np.int64))
    try:
        path = equilibrium_path(problem, times, on_checkpoint=lambda checkpoint: states.append(checkpoint.state))
        varied = [varied_sample(scene, problem, variants[name], at, name) for name in settings_varied(scene)]
    except SolveError as error:
        return FamilySolution(
            problem, [e for e in error.converged if e.t in times], at, [], base.off, failure=str(error)
        )
    coarsest = MeshSolution(base, System(problem, LOOSE), states[-1])
    samples, latest, stopped = [sample_of(scene, problem, path, at, math.nan)], coarsest, ""
    ancestors = np.arange(base.mesh.nelements)
    for target in targets(coarsest.system.total, plan.most):
        try:
            latest, parents = refined(latest, target)
        except SolveError as failure:
            stopped = f"the mesh of about {target:.0f} unknowns is left out: {failure}"
            break
        ancestors = ancestors[parents]
        samples.insert(0, end_sample(scene, latest, at))
        if len(samples) > 2 and fine_enough(scene, at, samples, plan.tolerance):
            break
    if latest is coarsest:
        return FamilySolution(problem, path, at, [*samples, *varied], base.off, stopped)
    fine, off = latest.system.problem, latest.mesh.off
    try:
        equilibria = all_checkpoints(scene, coarsest, states, latest, ancestors)
    except SolveError as error:
        return FamilySolution(fine, [], at, [], off, stopped, failure=str(error))
    samples[0] = sample_of(scene, fine, equilibria, at, math.nan)
    return FamilySolution(fine, equilibria, at, [*samples, *varied], off, stopped)


def varied_sample(scene: Scene, problem: Problem, better: Varied, at: SamplePoints, name: str) -> Sample:
    """The coarsest mesh with a setting made better. Raises SolveError."""
    work = better(problem, scene.checkpoints, NewtonSettings())
    path = [e for e in equilibrium_path(*work) if e.t in scene.checkpoints]
    return sample_of(scene, work[0], path, at, math.nan, name)


def problem_of(mesh: NestedMesh) -> Problem:
    """The scene on one of its nested meshes."""
    return problem_on(mesh.scene, mesh.mesh, mesh.patches, mesh.lumen)


def targets(first: int, most: float) -> list[float]:
    """Unknowns of the meshes after the first one, up to `most`, each in the same ratio to the one before."""
    steps = max(1, math.ceil(math.log(most / first) / math.log(GROWTH) - 1e-9)) if most > first else 0
    return [first * (most / first) ** (k / steps) for k in range(1, steps + 1)]


def refined(solved: MeshSolution, unknowns: float) -> tuple[MeshSolution, np.ndarray]:
    """The solution on a mesh of about so many unknowns, and the coarser element of each of its elements.

    Where Newton finds no equilibrium from the carried solution, a path from rest is tried. Raises SolveError where that
    breaks off.
    """
    mesh, system = solved.mesh, solved.system
    indicator = stress_indicator(system, solved.state.x)
    finer, parents = mesh.finer(indicator, round(mesh.mesh.nelements * unknowns / system.total))
    fine = System(problem_of(finer), LOOSE)
    system.solver.release()
    if fine.sticks.any():  # what an obstacle without slip holds depends on its way
        return MeshSolution(finer, fine, from_rest(fine, mesh.scene.checkpoints)), parents
    to = transfer(mesh.mesh, at_nodes(finer.body.mesh, parents), nodes(finer.mesh))
    try:
        state = continued(fine, carried(system, solved.state, fine, to))
    except StepFailed:
        state = from_rest(fine, mesh.scene.checkpoints)
    return MeshSolution(finer, fine, state), parents


def from_rest(system: System, times: Sequence[float]) -> State:
    """The state at the last of the times [s], by a load path. Raises SolveError where it breaks off."""
    state = system.rest()
    if system.starts_loaded():
        state, *_ = advance(system, state, system.settings.start, 1.0, [])
    for t in times:
        state, *_ = advance(system, state, t, 1.0, [])
    return state


def end_sample(scene: Scene, solved: MeshSolution, at: SamplePoints) -> Sample:
    """The sample of a mesh that is solved at the last checkpoint alone."""
    equilibrium = describe(solved.system, solved.state, solved.state.iterations, 1)
    return sample_of(scene, solved.system.problem, [equilibrium], at, math.nan)


def fine_enough(scene: Scene, at: SamplePoints, samples: Sequence[Sample], tolerance: float) -> bool:
    """Whether the error bars of the finest of the meshes, fine to coarse, are within the tolerance."""
    bars: dict[str, MeshError] = {
        name: uncertainty_of_meshes(scene, at, samples, name)
        for name in ("force_end", "surface_mean")
        if allowed(scene, name)
    }
    factors = {"force_end": 1.0, "surface_mean": DISPLACEMENT}
    return all(factors[name] * bar.uncertainty <= tolerance for name, bar in bars.items())


def all_checkpoints(
    scene: Scene, coarsest: MeshSolution, states: Sequence[State], finest: MeshSolution, ancestors: np.ndarray
) -> list[Equilibrium]:
    """The finest mesh at every checkpoint, from the last to the first, to the usual tolerances; by a load path where
    that does not lead there. Raises SolveError where the path breaks off.

    ancestors: the element of the coarsest mesh of each of the finest one's. Each checkpoint starts from the coarsest
    mesh's state, plus what the finest mesh changed at the checkpoint after it, in proportion to the displacement.
    """
    problem = finest.system.problem
    finest.system.solver.release()
    if finest.system.sticks.any():
        return equilibrium_path(problem, scene.checkpoints)
    system = System(problem, NewtonSettings())
    to = transfer(coarsest.mesh.mesh, at_nodes(finest.mesh.body.mesh, ancestors), nodes(finest.mesh.mesh))
    on_fine = [carried(coarsest.system, state, system, to) for state in states]
    try:
        state = continued(system, finest.state)
        equilibria = [describe(system, state, state.iterations, 1)]
        for start, after in zip(on_fine[-2::-1], on_fine[:0:-1], strict=True):
            state = continued(system, corrected(system, start, after, state))
            equilibria.insert(0, describe(system, state, state.iterations, 1))
    except StepFailed:
        return equilibrium_path(problem, scene.checkpoints)
    finally:
        system.solver.release()
    return equilibria


def corrected(system: System, start: State, after: State, solved: State) -> State:
    """A carried state, plus what solving changed in the carried state `after`, in proportion to the unknowns."""
    share = np.linalg.norm(start.x) / max(float(np.linalg.norm(after.x)), np.finfo(float).tiny)
    x = start.x + share * (solved.x - after.x)
    x[system.pattern.held] = system.held_at(start.t)
    return replace(start, x=x)
