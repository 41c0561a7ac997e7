"""One solution of a scene's reference: what it depends on, where it lies, how it is solved and stored."""

import json
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from reference_fem import (
    DynamicsSettings,
    Equilibrium,
    Moment,
    NewtonSettings,
    Problem,
    ReferenceProblem,
    equilibrium_path,
    motion_path,
    nodes,
)
from studies.base.errors import StudyError
from studies.reference.checkpoints import drop, keep, kept
from studies.reference.fields import fields_of
from studies.reference.problem import reference_problem
from studies.scene.as_json import scene_to_json
from studies.scene.scene import Scene
from studies.store.fingerprint import source_fingerprint
from studies.store.new_record import new_record
from studies.store.paths import record_path
from studies.store.record import Status, peek, write_record
from studies.store.staleness import CASE_CHANGED, CODE_CHANGED, MISSING, is_current, why_stale

STUDY = "reference"
PENALTY_FACTOR, KAPPA_FACTOR, STEP_FACTOR = 3.0, 10.0, 2.0
"""How much better a setting is made: stiffer contact with as much less penetration, bulk modulus, load steps."""


@dataclass(frozen=True)
class Piece:
    """A mesh of the scene's family, or that mesh with one setting made better."""

    scene: Scene
    level: float
    variant: str = ""
    """"" or a name of VARIANTS."""

    @property
    def name(self) -> str:
        """For people and file names."""
        return f"{self.scene.name}-{self.level:g}" + (f"-{self.variant}" if self.variant else "")

    @property
    def key(self) -> str:
        """What the solution depends on, besides the code: not the frames or the other meshes; without motion not the
        damping or the start."""
        scene, plan = self.scene, self.scene.reference
        assert plan is not None  # a piece belongs to a plan
        plain = replace(
            scene,
            title="",
            duration=0.0,
            frames=0,
            reference=replace(plan, levels=(self.level, self.level), variants=()),
            quantities=(),
            not_for=(),
        )
        if plan.dt is None:
            plain = replace(plain, damping=0.0, start=None)
        data = {"scene": json.loads(scene_to_json(plain)), "level": self.level, "variant": self.variant}
        return json.dumps(data, sort_keys=True, ensure_ascii=False)

    @property
    def moves(self) -> bool:
        """Whether it is a motion in time; a load path builds no mass."""
        return self.scene.reference is not None and self.scene.reference.dt is not None

    def path(self, root: Path) -> Path:
        """Where it lies."""
        return record_path(root, STUDY, self.name, self.key)

    def is_current(self, root: Path) -> bool:
        """Whether it is there, from this code, as it was written."""
        return is_current(self.path(root), self.key, reference_fingerprint())

    def why_stale(self, root: Path) -> str | None:
        """Why it must be solved (again) (studies.store.staleness); None when it need not."""
        return why_stale(self.path(root), self.key, reference_fingerprint())

    @property
    def stamp(self) -> str:
        """Problem and code in one text."""
        return f"{reference_fingerprint()} {self.key}"

    def state(self, root: Path) -> str:
        """ "missing", "half-way", "unreadable", "stale", or the status it ended with."""
        if kept(self.path(root), self.stamp) is not None:
            return "half-way"
        why = self.why_stale(root)
        if why is None:
            return str(peek(self.path(root)).status)
        return "missing" if why == MISSING else "stale" if why in (CASE_CHANGED, CODE_CHANGED) else "unreadable"

    @property
    def weight(self) -> float:
        """What it costs, roughly: unknowns."""
        return self.level if self.level > 1 else self.level**-3


def pieces(scene: Scene) -> list[Piece]:
    """All that the reference of a scene is made of: every mesh, and each setting made better on the coarsest."""
    if scene.reference is None:
        return []
    family = [Piece(scene, level) for level in scene.reference.levels]
    return [*family, *(replace(family[0], variant=name) for name in variants(scene))]


def variants(scene: Scene) -> list[str]:
    """The settings that matter in a scene: nothing touches, nothing sinks in."""
    assert scene.reference is not None
    return [name for name in scene.reference.variants if name != "contact" or scene.obstacles]


JUDGES = ("bench.py", "crosscheck", "exact.py", "modes.py", "oracles/", "uncertainty.py")
"""Beginnings of the solver's files that no reference is computed with: they judge it."""


def reference_fingerprint() -> str:
    """Hash of all code that a reference depends on."""
    return source_fingerprint(
        "reference_fem",
        "studies.geometry",
        "studies.runs.prepare",
        "studies.reference.problem",
        "studies.reference.fields",
        "studies.reference.mesh",
        "studies.reference.solve",
        without=JUDGES,
    )


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


def solve(root: Path, piece: Piece) -> Path:
    """Solves the scene's load path and stores it; a path that breaks off is stored up to there."""
    checkpoints = piece.scene.checkpoints
    work: Set = (reference_problem(piece.scene, piece.level), checkpoints, NewtonSettings())
    if piece.variant:
        work = VARIANTS[piece.variant][0](*work)
    problem, times, settings = work
    record_file, stamp = piece.path(root), piece.stamp
    before = kept(record_file, stamp)
    started = time.monotonic()
    status, message = Status.OK, ""
    try:
        if piece.moves:
            path = motion(piece, *work)
        else:
            path = equilibrium_path(
                problem, times, settings, on_checkpoint=lambda c: keep(record_file, stamp, c), resume=before
            )
    except ReferenceProblem as error:
        path = error.converged
        status, message = Status.NOT_CONVERGED, str(error)
    found = [e for e in path if e.t in checkpoints]
    record = new_record(
        kind="reference",
        key=piece.key,
        name=piece.name,
        status=status,
        message=message,
        fingerprint=reference_fingerprint(),
        attributes=_attributes(piece, problem, found, time.monotonic() - started),
        fields=fields_of(piece.scene, problem, found),
    )
    write_record(record_file, record)
    drop(record_file)
    return record_file


def motion(piece: Piece, problem: Problem, times: tuple[float, ...], settings: NewtonSettings) -> list[Moment]:
    """The scene's motion from its start, with its damping. Raises ReferenceProblem; StudyError for another shape."""
    scene, plan = piece.scene, piece.scene.reference
    assert plan is not None and plan.dt is not None  # it moves
    if scene.start is not None and scene.start.shaped:
        raise StudyError(
            f"scene '{scene.name}' starts in a shape of its own, and the reference from rest or with a speed; "
            f"give it a speed, or no reference"
        )
    dt = plan.dt / (STEP_FACTOR if piece.variant == "steps" else 1.0)
    velocity = None if scene.start is None else scene.start.velocities(nodes(problem.mesh))
    return motion_path(problem, times, DynamicsSettings(dt, scene.damping, newton=settings), velocity)


def _attributes(piece: Piece, problem: Problem, found: list[Equilibrium], seconds: float) -> dict:
    return {
        "scene": piece.scene.name,
        "level": float(piece.level),
        "variant": piece.variant,
        "unknowns": 3 * len(nodes(problem.mesh)) + problem.mesh.nvertices,
        "steps_done": len(found),
        "seconds": seconds,
    }
