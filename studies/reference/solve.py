"""Solves the reference of a scene and stores it."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from reference_fem import (
    DynamicsSettings,
    Equilibrium,
    Moment,
    NewtonSettings,
    Problem,
    SolveError,
    equilibrium_path,
    motion_path,
    nodes,
)
from studies.base.doing import doing
from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import mean_edge, tetrahedron_facets
from studies.reference.nested import FamilySolution, solve_nested
from studies.reference.problem import reference_problem, whole_forces
from studies.reference.reference_solves import ReferenceSolve, reference_fingerprint, settings_varied
from studies.reference.sample import Sample, SamplePoints, mean_pressure, sample_fields, sample_of
from studies.reference.shape import shape_attributes, shape_of
from studies.reference.solution import Solution
from studies.reference.uncertainty import KAPPA_FACTOR, PENALTY_FACTOR, STEP_FACTOR
from studies.scene.scene import Scene
from studies.store.record import Field, Status, new_fields, new_record, write_record
from studies.store.schema import REFERENCE_FIELDS

Set = tuple[Problem, tuple[float, ...], NewtonSettings]


def finer_steps(problem: Problem, times: tuple[float, ...], settings: NewtonSettings) -> Set:
    """Load steps half as long."""
    starts = (settings.start, *times[:-1])
    halves = [(start + end) / STEP_FACTOR for start, end in zip(starts, times, strict=True)]
    return problem, tuple(sorted({*times, *halves})), settings


def stiffer_contact(problem: Problem, times: tuple[float, ...], settings: NewtonSettings) -> Set:
    """Penalty three times as stiff, a third of the penetration allowed."""
    stiffer = replace(
        settings,
        penalty=PENALTY_FACTOR * settings.penalty,
        penetration_tol=settings.penetration_tol / PENALTY_FACTOR,
    )
    return problem, times, stiffer


def less_compressible(problem: Problem, times: tuple[float, ...], settings: NewtonSettings) -> Set:
    """Bulk modulus ten times as large."""
    material = replace(problem.material, kappa=KAPPA_FACTOR * problem.material.kappa)
    return replace(problem, material=material), times, settings


VARIANTS: dict[str, Callable[[Problem, tuple[float, ...], NewtonSettings], Set]] = {
    "steps": finer_steps,
    "contact": stiffer_contact,
    "kappa": less_compressible,
}
"""Refined settings by their names in a plan. The factors are in studies.reference.uncertainty.FACTORS."""


def solve(root: Path, reference_solve: ReferenceSolve) -> Path:
    """Solves the scene on all meshes of its plan and stores the finest solution, with its uncertainty from the others;
    if a path breaks off, the part that was reached. Raises StudyError for a mesh that cannot be made."""
    scene, started = reference_solve.scene, time.monotonic()
    assert scene.reference is not None  # a reference solve belongs to a plan
    solution = solve_nested(scene, VARIANTS) if scene.reference.nested else solve_levels(scene)
    record_file = reference_solve.path(root)
    record = new_record(
        kind="reference",
        key=reference_solve.key,
        name=reference_solve.name,
        status=Status.NOT_CONVERGED if solution.failure else Status.OK,
        message=solution.failure,
        fingerprint=reference_fingerprint(),
        attributes={
            "scene": scene.name,
            "unknowns": 3 * len(nodes(solution.problem.mesh)) + solution.problem.mesh.nvertices,
            "steps_done": len(solution.equilibria),
            "off_shape": solution.off,
            "stopped": solution.stopped,
            "seconds": time.monotonic() - started,
        },
        fields=fields_of(scene, solution),
    )
    if record.status == Status.OK:
        shape = shape_attributes(scene.name, shape_of(Solution(scene, record)).distance)
        record = replace(record, attributes=record.attributes | shape)
    write_record(record_file, record)
    return record_file


def fields_of(scene: Scene, solution: FamilySolution) -> dict[str, Field]:
    """The equilibria at the checkpoints, one row each, NaN for checkpoints that the path did not reach; and the
    samples."""
    problem, equilibria = solution.problem, solution.equilibria
    x, tetrahedra = nodes(problem.mesh), problem.mesh.t.T.astype(np.int64)
    lengths = {"K": len(scene.checkpoints), "o": len(scene.obstacles), "g": len(problem.held), "n": len(x)}

    def row(e: Equilibrium) -> dict[str, np.ndarray | float]:
        return {
            "contact_force": whole_forces(scene, e.obstacle_force[None])[0],
            "held_force": e.held_force,
            "volume": e.volume / e.volume0,
            "pressure": mean_pressure(problem, e),
            "lumen_pressure": float(e.cavity_pressure.sum()) if scene.filled else np.nan,
            "min_j": e.min_J,
            "max_j": e.max_J,
            "penetration": e.penetration,
            "newton": float(e.newton_iterations),
            "energy": e.energy,
            "kinetic": _of_motion(e, "kinetic"),
            "balance": _of_motion(e, "balance"),
            "displacement": e.u,
        }

    rows = [row(e) for e in equilibria]
    values = {"t": np.array(scene.checkpoints), "nodes": x, "tetrahedra": tetrahedra}
    values |= sample_fields(solution.at, solution.samples, len(scene.checkpoints))
    for name in REFERENCE_FIELDS.keys() - values.keys():
        if REFERENCE_FIELDS[name].optional:
            continue
        shape = REFERENCE_FIELDS[name].shape.split()
        values[name] = np.full([lengths[part] if part in lengths else int(part) for part in shape], np.nan)
        for k, reached in enumerate(rows):
            values[name][k] = reached[name]
    return new_fields(REFERENCE_FIELDS, {name: values[name] for name in REFERENCE_FIELDS if name in values})


def _of_motion(equilibrium: Equilibrium, name: str) -> float:
    return getattr(equilibrium, name) if isinstance(equilibrium, Moment) else np.nan


def solve_levels(scene: Scene) -> FamilySolution:
    """The solutions on each level of the scene's plan, then on the coarsest with each refined setting."""
    plan, times = scene.reference, scene.checkpoints
    assert plan is not None  # the scene has a reference
    runs = [(level, "") for level in plan.levels] + [(plan.levels[0], name) for name in settings_varied(scene)]
    at, samples, finest = None, list[Sample](), None
    for number, (level, variant) in enumerate(runs, 1):
        other = f" with other {variant}" if variant else ""
        doing(f"reference of {scene.name}: mesh {1 if variant else number} of {len(plan.levels)}{other}")
        work: Set = (reference_problem(scene, level), times, NewtonSettings())
        problem = work[0]
        if at is None:
            corners = problem.mesh.t[:4].T.astype(np.int64)
            at = SamplePoints(nodes(problem.mesh)[: problem.mesh.nvertices], corners, scene.symmetric)
        if variant:
            work = VARIANTS[variant](*work)
        try:
            path = motion(scene, variant, *work) if plan.dt is not None else equilibrium_path(*work)
        except SolveError as error:
            reached = [e for e in error.converged if e.t in times]
            return FamilySolution(problem, reached, at, samples, failure=f"on mesh {level:g}{other}: {error}")
        path = [e for e in path if e.t in times]
        samples.append(sample_of(scene, work[0], path, at, element_size(scene, level), variant))
        if (level, variant) == (plan.levels[-1], ""):
            finest = problem, path
    assert at is not None and finest is not None  # a plan has two levels or more
    meshes, variants = samples[: len(plan.levels)], samples[len(plan.levels) :]
    return FamilySolution(*finest, at, [*reversed(meshes), *variants])


def element_size(scene: Scene, level: float) -> float:
    """Mean edge [m] of the mesh `level` of the scene's plan; for an octant the size away from the contact."""
    if scene.symmetric:
        return level * float(scene.organ.parameters["radius"])
    mesh = reference_problem(scene, level).mesh
    return mean_edge(nodes(mesh), tetrahedron_facets(mesh.t[:4].T))


def motion(
    scene: Scene, variant: str, problem: Problem, times: tuple[float, ...], settings: NewtonSettings
) -> list[Moment]:
    """The scene's motion from its start, with its damping. Raises SolveError; StudyError for another shape."""
    plan = scene.reference
    assert plan is not None and plan.dt is not None  # it moves
    if scene.start is not None and scene.start.shaped:
        raise StudyError(
            f"scene '{scene.name}' starts in a shape of its own, and the reference from rest or with a speed; "
            f"give it a speed, or no reference"
        )
    dt = plan.dt / (STEP_FACTOR if variant == "steps" else 1.0)
    velocity = None if scene.start is None else scene.start.velocities(nodes(problem.mesh))
    return motion_path(problem, times, DynamicsSettings(dt, scene.damping, newton=settings), velocity)
