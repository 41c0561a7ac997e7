"""A reference on nested meshes: each solution starts from that of the coarser mesh, and its error indicator selects the
elements to refine next."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import NamedTuple

import numpy as np

from massspring.body.opening import parents
from reference_fem import Checkpoint, Equilibrium, NewtonSettings, Problem, SolveError, equilibrium_path, nodes
from reference_fem.elements.shapes import element_nodes
from reference_fem.estimate import stress_indicator
from reference_fem.statics.equilibrium import advance, describe
from reference_fem.statics.nested import carried, continued, transfer
from reference_fem.statics.newton import StepFailed
from reference_fem.system.saddle_point import System
from reference_fem.system.state import State
from reference_fem.uncertainty import MeshError
from studies.base.doing import doing
from studies.meshing.nested_mesh import CHILD, NestedMesh, at_nodes, base_mesh
from studies.reference.problem import problem_on
from studies.reference.reference_solves import settings_varied
from studies.reference.sample import Sample, SamplePoints, sample_of
from studies.reference.uncertainty import uncertainty_of_meshes
from studies.scene.clock import check_judged_after_cut
from studies.scene.quantities import allowed
from studies.scene.scene import Scene

GROWTH = 2.5
"""Largest ratio of the unknowns of a mesh to those of the one before: for larger steps the indicator is too
inaccurate."""
LEAST_GROWTH = 1.5
"""Smallest such ratio, even if the plan's `most` is exceeded."""
LOOSE = NewtonSettings(force_tol=1e-4)
"""Settings for all meshes but the coarsest: a larger force tolerance than usual, the usual penetration."""
DISPLACEMENT = 2.5
"""Weight of the error bar of the mean displacement relative to that of the force: it falls faster, so its bound is
tighter."""


Work = tuple[Problem, tuple[float, ...], NewtonSettings]
"""A problem, the checkpoints at which it is solved [s], and the solver settings."""


class Part(NamedTuple):
    """A problem, solved at its checkpoints."""

    system: System
    states: Sequence[State]


class MeshSolution(NamedTuple):
    """One mesh, solved at every checkpoint."""

    mesh: NestedMesh
    parts: Sequence[Part]
    """Solutions of the problems of `problems_of(mesh)`."""

    @property
    def system(self) -> System:
        """System of the last checkpoint."""
        return self.parts[-1].system

    @property
    def equilibria(self) -> list[Equilibrium]:
        """Equilibria at every checkpoint, at the nodes of the mesh that is solved last."""
        equilibria = list[Equilibrium]()
        for system, states in self.parts:
            here = [describe(system, state, state.iterations, 1) for state in states]
            equilibria += in_last_mesh(self.mesh, system.problem, here)
        return equilibria


@dataclass(frozen=True, eq=False)
class FamilySolution:
    """The solutions on the meshes of a scene."""

    problem: Problem
    """Problem on the finest mesh that was solved."""
    equilibria: Sequence[Equilibrium]
    """Equilibria at the scene's checkpoints; fewer if the path broke off."""
    at: SamplePoints
    samples: Sequence[Sample]
    """Samples of the meshes, fine to coarse, then of the refined settings."""
    off: int = 0
    """Boundary nodes of the finest mesh that are not on the true shape."""
    stopped: str = ""
    """Why refinement ended before the tolerance of the plan was met; "" if it was met."""
    failure: str = ""
    """Why there is no reference; "" if there is one."""


Varied = Callable[[Problem, tuple[float, ...], NewtonSettings], tuple[Problem, tuple[float, ...], NewtonSettings]]


def solve_nested(scene: Scene, variants: Mapping[str, Varied]) -> FamilySolution:
    """The scene on its nested meshes, the coarsest also with each setting of its plan refined.

    Raises StudyError for a mesh that cannot be made.
    """
    plan, times, mesh = scene.reference, scene.checkpoints, f"reference of {scene.name}: mesh"
    assert plan is not None  # the scene has a reference
    doing(f"{mesh} 1 of its family")
    base = base_mesh(scene, plan.base, plan.at_contact)
    work, ends = problems_of(base), list[Checkpoint]()
    problem = work[-1][0]
    at = SamplePoints(nodes(base.mesh)[: base.mesh.nvertices], base.mesh.t[:4].T.astype(np.int64))
    try:
        equilibria, varied = path_of(base, work, ends.append), list[Sample]()
        for name in settings_varied(scene):
            doing(f"{mesh} 1 of its family with other {name}")
            path = path_of(base, work, better=variants[name])
            varied.append(sample_of(scene, problem, path, at, math.nan, name))
    except SolveError as error:
        reached = [e for e in error.converged if e.t in times]
        return FamilySolution(problem, reached, at, [], base.off, failure=str(error))
    states = iter([end.state for end in ends])
    latest = MeshSolution(base, [Part(System(one, LOOSE), list(islice(states, len(some)))) for one, some, _ in work])
    samples, stopped = [sample_of(scene, problem, equilibria, at, math.nan)], ""
    sizes = targets(latest.system.total, plan.most)
    for number, target in enumerate(sizes, 2):
        doing(f"{mesh} {number} of {1 + len(sizes)}, {target:,.0f} unknowns")
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
        if len(samples) > 2 and fine_enough(scene, at, samples, plan.tolerance) and not latest.mesh.far.any():
            break
    for part in latest.parts:
        part.system.solver.release()
    alone = f"only the coarsest mesh was solved, so nothing says how accurate it is; {stopped}"
    failure = "" if len(samples) > 1 else alone
    return FamilySolution(latest.system.problem, equilibria, at, [*samples, *varied], latest.mesh.off, stopped, failure)


def path_of(
    mesh: NestedMesh,
    work: Sequence[Work],
    on_checkpoint: Callable[[Checkpoint], None] | None = None,
    better: Varied | None = None,
) -> list[Equilibrium]:
    """Equilibria of the problems on one of the nested meshes in order, at the nodes of the last problem; `better`
    refines a setting. Raises SolveError, which holds the equilibria that were reached."""
    equilibria = list[Equilibrium]()
    for one in work:
        try:
            path = equilibrium_path(*(one if better is None else better(*one)), on_checkpoint=on_checkpoint)
        except SolveError as error:
            reached = in_last_mesh(mesh, one[0], error.converged)
            raise SolveError(str(error), converged=[*equilibria, *reached]) from error
        equilibria += in_last_mesh(mesh, one[0], [e for e in path if e.t in one[1]])
    return equilibria


def problem_of(mesh: NestedMesh) -> Problem:
    """The scene on one of its nested meshes, opened if it is cut. Raises StudyError if no checkpoint follows a cut."""
    check_judged_after_cut(mesh.scene)
    return problem_on(mesh.scene, mesh.solved, mesh.patches, mesh.lumen_at(math.inf))


def problems_of(mesh: NestedMesh) -> list[Work]:
    """The problems of a scene on one of its nested meshes with their checkpoints, one for each state of the cuts: the
    body is opened along the cuts made by then. Each problem has a load path from rest, since the tissue has no memory.
    Raises StudyError."""
    scene, after = mesh.scene, problem_of(mesh)
    made = [sum(cut.at < t for cut in scene.cuts) for t in scene.checkpoints]
    work = list[Work]()
    for count in dict.fromkeys(made):
        times = tuple(t for t, before in zip(scene.checkpoints, made, strict=True) if before == count)
        problem = after
        if count < len(scene.cuts):
            opened, parent = mesh.opened_until(times[0])
            problem = problem_on(scene, opened, mesh.held_in(parent), mesh.lumen_at(times[0]))
        work.append((problem, times, NewtonSettings()))
    return work


def in_last_mesh(mesh: NestedMesh, problem: Problem, equilibria: Sequence[Equilibrium]) -> list[Equilibrium]:
    """Equilibria of one of the problems at the nodes of the mesh that is solved last: copies of a node coincide until a
    cut separates them."""
    if problem.mesh is mesh.solved:
        return list(equilibria)
    node = parents(element_nodes(problem.mesh), element_nodes(mesh.solved))
    vertices = node[: mesh.solved.nvertices]
    return [replace(one, u=one.u[node], p=one.p[vertices]) for one in equilibria]


def targets(first: int, most: float) -> list[float]:
    """Numbers of unknowns of the meshes after the first one, up to `most`, with a constant ratio. There is at least
    one, LEAST_GROWTH times as large, since an error bar needs a second mesh."""
    most = max(most, LEAST_GROWTH * first)
    steps = max(1, math.ceil(math.log(most / first) / math.log(GROWTH) - 1e-9))
    return [first * (most / first) ** (k / steps) for k in range(1, steps + 1)]


def refined(solved: MeshSolution, unknowns: float) -> MeshSolution:
    """The solution on a mesh of about `unknowns` unknowns, refined where it is far from the true shape, then by the
    error indicator of the last checkpoint.

    If Newton finds no equilibrium from the transferred states, a path from rest is tried. Raises SolveError if that
    breaks off.
    """
    mesh, last = solved.mesh, solved.parts[-1]
    indicator = stress_indicator(last.system, last.states[-1].x)
    indicator = np.where(mesh.far, indicator.max() / CHILD, indicator)
    finer, parents = mesh.finer(indicator, round(mesh.mesh.nelements * unknowns / last.system.total))
    work = problems_of(finer)
    return MeshSolution(finer, [on_finer(old, new, parents) for old, new in zip(solved.parts, work, strict=True)])


def on_finer(part: Part, work: Work, parents: np.ndarray) -> Part:
    """Solves the problem of `part` on a finer mesh, whose elements are parts of the elements `parents` (ne,) of the
    coarser one. Raises SolveError."""
    fine = System(work[0], LOOSE)
    part.system.solver.release()
    if fine.sticks.any():  # the points held by a no-slip obstacle depend on its path
        return Part(fine, from_rest(fine, work[1]))
    coarse, mesh = part.system.problem.mesh, work[0].mesh
    to = transfer(coarse, at_nodes(mesh, parents), nodes(mesh))
    try:
        return Part(fine, from_carried(fine, [carried(part.system, state, fine, to) for state in part.states]))
    except StepFailed:
        return Part(fine, from_rest(fine, work[1]))


def from_carried(system: System, starts: Sequence[State]) -> list[State]:
    """The equilibria near transferred states, the last first. The start of each other one is corrected by the change
    that the solution made to the next one, in proportion to the unknowns. Raises StepFailed."""
    states = [continued(system, starts[-1])]
    for start, after in zip(starts[-2::-1], starts[:0:-1], strict=True):
        share = np.linalg.norm(start.x) / max(float(np.linalg.norm(after.x)), np.finfo(float).tiny)
        x = start.x + share * (states[0].x - after.x)
        x[system.pattern.held] = system.held_at(start.t)
        states.insert(0, continued(system, replace(start, x=x)))
    return states


def from_rest(system: System, times: Sequence[float]) -> list[State]:
    """The states at the times [s] of a load path. Raises SolveError if it breaks off."""
    state, states = system.rest(), list[State]()
    if system.starts_loaded():
        state, *_ = advance(system, state, system.settings.start, 1.0, [])
    for t in times:
        state, *_ = advance(system, state, t, 1.0, [])
        states.append(state)
    return states


def fine_enough(scene: Scene, at: SamplePoints, samples: Sequence[Sample], tolerance: float) -> bool:
    """Whether the error bars of the finest mesh are within the tolerance; `samples`: fine to coarse."""
    bars: dict[str, MeshError] = {
        name: uncertainty_of_meshes(scene, at, samples, name)
        for name in ("force_end", "surface_mean")
        if allowed(scene, name)
    }
    factors = {"force_end": 1.0, "surface_mean": DISPLACEMENT}
    return all(factors[name] * bar.uncertainty <= tolerance for name, bar in bars.items())
