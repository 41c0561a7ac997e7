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
from studies.scene.clock import check_after_cut
from studies.scene.quantities import allowed
from studies.scene.scene import Scene

GROWTH = 2.5
"""Unknowns of a mesh over those of the one before, at most: more, and its indicator knows too little of the next."""
LEAST_GROWTH = 1.5
"""The same at least, also where the plan's `most` is smaller."""
LOOSE = NewtonSettings(force_tol=1e-4, penetration_tol=1e-3)
"""On all meshes but the coarsest: forces are within 3e-4 of those of the usual tolerances, in half the time."""
DISPLACEMENT = 2.5
"""Bar of the mean displacement that weighs as much as one of the force: it falls faster, so less is allowed."""


class MeshSolution(NamedTuple):
    """One mesh, solved at every checkpoint."""

    mesh: NestedMesh
    system: System
    states: Sequence[State]

    @property
    def equilibria(self) -> list[Equilibrium]:
        """At every checkpoint."""
        return [describe(self.system, state, state.iterations, 1) for state in self.states]


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
        equilibria = equilibrium_path(problem, times, on_checkpoint=lambda checkpoint: states.append(checkpoint.state))
        varied = [varied_sample(scene, problem, variants[name], at, name) for name in settings_varied(scene)]
    except SolveError as error:
        reached = [e for e in error.converged if e.t in times]
        return FamilySolution(problem, reached, at, [], base.off, failure=str(error))
    latest = MeshSolution(base, System(problem, LOOSE), states)
    samples, stopped = [sample_of(scene, problem, equilibria, at, math.nan)], ""
    for target in targets(latest.system.total, plan.most):
        try:
            latest, before = refined(latest, target), latest
        except SolveError as failure:
            stopped = f"the mesh of about {target:.0f} unknowns is left out: {failure}"
            break
        if latest.system.total == before.system.total:
            stopped = "no element of the finest mesh has an error indicator above 0"
            break
        equilibria = latest.equilibria
        samples.insert(0, sample_of(scene, latest.system.problem, equilibria, at, math.nan))
        if len(samples) > 2 and fine_enough(scene, at, samples, plan.tolerance):
            break
    latest.system.solver.release()
    return FamilySolution(latest.system.problem, equilibria, at, [*samples, *varied], latest.mesh.off, stopped)


def varied_sample(scene: Scene, problem: Problem, better: Varied, at: SamplePoints, name: str) -> Sample:
    """The coarsest mesh with a setting made better. Raises SolveError."""
    work = better(problem, scene.checkpoints, NewtonSettings())
    path = [e for e in equilibrium_path(*work) if e.t in scene.checkpoints]
    return sample_of(scene, work[0], path, at, math.nan, name)


def problem_of(mesh: NestedMesh) -> Problem:
    """The scene on one of its nested meshes. Raises StudyError for a checkpoint before the cut."""
    check_after_cut(mesh.scene)
    return problem_on(mesh.scene, mesh.solved, mesh.patches, mesh.lumen)


def targets(first: int, most: float) -> list[float]:
    """Unknowns of the meshes after the first one, up to `most`, each in the same ratio to the one before; at least one
    that is LEAST_GROWTH times as large, for without a second mesh there is no error bar."""
    most = max(most, LEAST_GROWTH * first)
    steps = max(1, math.ceil(math.log(most / first) / math.log(GROWTH) - 1e-9))
    return [first * (most / first) ** (k / steps) for k in range(1, steps + 1)]


def refined(solved: MeshSolution, unknowns: float) -> MeshSolution:
    """The solution on a mesh of about so many unknowns, refined where the last checkpoint needs it.

    Where Newton finds no equilibrium from the carried states, a path from rest is tried. Raises SolveError where that
    breaks off.
    """
    mesh, system, times = solved.mesh, solved.system, solved.mesh.scene.checkpoints
    indicator = stress_indicator(system, solved.states[-1].x)
    finer, parents = mesh.finer(indicator, round(mesh.mesh.nelements * unknowns / system.total))
    fine = System(problem_of(finer), LOOSE)
    system.solver.release()
    if fine.sticks.any():  # what an obstacle without slip holds depends on its way
        return MeshSolution(finer, fine, from_rest(fine, times))
    to = transfer(mesh.solved, at_nodes(finer.solved, parents), nodes(finer.solved))
    try:
        states = from_carried(fine, [carried(system, state, fine, to) for state in solved.states])
    except StepFailed:
        states = from_rest(fine, times)
    return MeshSolution(finer, fine, states)


def from_carried(system: System, starts: Sequence[State]) -> list[State]:
    """The equilibria near carried states, the last first: each other one starts with what solving changed in the one
    after it, in proportion to the unknowns. Raises StepFailed."""
    states = [continued(system, starts[-1])]
    for start, after in zip(starts[-2::-1], starts[:0:-1], strict=True):
        share = np.linalg.norm(start.x) / max(float(np.linalg.norm(after.x)), np.finfo(float).tiny)
        x = start.x + share * (states[0].x - after.x)
        x[system.pattern.held] = system.held_at(start.t)
        states.insert(0, continued(system, replace(start, x=x)))
    return states


def from_rest(system: System, times: Sequence[float]) -> list[State]:
    """The states at the times [s] of a load path. Raises SolveError where it breaks off."""
    state, states = system.rest(), list[State]()
    if system.starts_loaded():
        state, *_ = advance(system, state, system.settings.start, 1.0, [])
    for t in times:
        state, *_ = advance(system, state, t, 1.0, [])
        states.append(state)
    return states


def fine_enough(scene: Scene, at: SamplePoints, samples: Sequence[Sample], tolerance: float) -> bool:
    """Whether the error bars of the finest of the meshes, fine to coarse, are within the tolerance."""
    bars: dict[str, MeshError] = {
        name: uncertainty_of_meshes(scene, at, samples, name)
        for name in ("force_end", "surface_mean")
        if allowed(scene, name)
    }
    factors = {"force_end": 1.0, "surface_mean": DISPLACEMENT}
    return all(factors[name] * bar.uncertainty <= tolerance for name, bar in bars.items())
