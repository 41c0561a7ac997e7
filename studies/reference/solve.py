"""One solution of a scene's reference: how it is solved and stored."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

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
from reference_fem.model.problem import find_held
from studies.base.errors import StudyError
from studies.reference.checkpoints import drop, keep, kept
from studies.reference.fields import fields_of
from studies.reference.problem import reference_problem
from studies.reference.reference_solves import ReferenceSolve, reference_fingerprint
from studies.reference.size import element_size, outline_size
from studies.store.new_record import new_record
from studies.store.record import Status, write_record

PENALTY_FACTOR, KAPPA_FACTOR, STEP_FACTOR = 3.0, 10.0, 2.0
"""How much better a setting is made: stiffer contact with as much less penetration, bulk modulus, load steps."""


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


VARIANTS: dict[str, tuple[Callable[[Problem, tuple[float, ...], NewtonSettings], Set], float]] = {
    "steps": (finer_steps, STEP_FACTOR),
    "contact": (stiffer_contact, PENALTY_FACTOR),
    "kappa": (less_compressible, KAPPA_FACTOR),
}
"""Each with the factor by which it makes a setting better."""


def solve(root: Path, reference_solve: ReferenceSolve) -> Path:
    """Solves the scene's load path and stores it; a path that breaks off is stored up to there."""
    checkpoints = reference_solve.scene.checkpoints
    work: Set = (reference_problem(reference_solve.scene, reference_solve.level), checkpoints, NewtonSettings())
    if reference_solve.variant:
        work = VARIANTS[reference_solve.variant][0](*work)
    problem, times, settings = work
    record_file, stamp = reference_solve.path(root), reference_solve.stamp
    before = kept(record_file, stamp)
    started = time.monotonic()
    status, message = Status.OK, ""
    try:
        if reference_solve.moves:
            path = motion(reference_solve, *work)
        else:
            path = equilibrium_path(
                problem, times, settings, on_checkpoint=lambda c: keep(record_file, stamp, c), resume=before
            )
    except SolveError as error:
        path = error.converged
        status, message = Status.NOT_CONVERGED, str(error)
    found = [e for e in path if e.t in checkpoints]
    record = new_record(
        kind="reference",
        key=reference_solve.key,
        name=reference_solve.name,
        status=status,
        message=message,
        fingerprint=reference_fingerprint(),
        attributes=_attributes(reference_solve, problem, found, time.monotonic() - started),
        fields=fields_of(reference_solve.scene, problem, found),
    )
    write_record(record_file, record)
    drop(record_file)
    return record_file


def motion(
    reference_solve: ReferenceSolve, problem: Problem, times: tuple[float, ...], settings: NewtonSettings
) -> list[Moment]:
    """The scene's motion from its start, with its damping. Raises SolveError; StudyError for another shape."""
    scene, plan = reference_solve.scene, reference_solve.scene.reference
    assert plan is not None and plan.dt is not None  # it moves
    if scene.start is not None and scene.start.shaped:
        raise StudyError(
            f"scene '{scene.name}' starts in a shape of its own, and the reference from rest or with a speed; "
            f"give it a speed, or no reference"
        )
    dt = plan.dt / (STEP_FACTOR if reference_solve.variant == "steps" else 1.0)
    velocity = None if scene.start is None else scene.start.velocities(nodes(problem.mesh))
    return motion_path(problem, times, DynamicsSettings(dt, scene.damping, newton=settings), velocity)


def _attributes(reference_solve: ReferenceSolve, problem: Problem, found: list[Equilibrium], seconds: float) -> dict:
    held = [] if reference_solve.scene.symmetric else find_held(problem)  # planes of symmetry hold no region
    return {
        "scene": reference_solve.scene.name,
        "level": float(reference_solve.level),
        "variant": reference_solve.variant,
        "size": element_size(reference_solve.scene, reference_solve.level),
        "outline_size": outline_size(problem.mesh, held),  # pyright: ignore[reportArgumentType]
        "unknowns": 3 * len(nodes(problem.mesh)) + problem.mesh.nvertices,
        "steps_done": len(found),
        "seconds": seconds,
    }
