"""The finite-element reference of a scene: solved once per mesh, stored, read back with its own error bar."""

import json
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path

import numpy as np
from skfem import MeshTet2

from reference_fem import Equilibrium, Evaluator, Problem, ReferenceProblem, equilibrium_path, nodes, surface_triangles
from studies.adapt_reference import reference_problem, whole_forces
from studies.case import scene_to_json
from studies.distance import hausdorff
from studies.errors import StudyError
from studies.fingerprint import source_fingerprint
from studies.paths import record_path
from studies.records import new_record
from studies.scenes.base import Scene
from studies.store import Field, Record, Status, is_current, read_record, write_record

STUDY = "reference"


def reference_key(scene: Scene, level: float) -> str:
    """What the stored solution depends on, besides the code: not the frames, the damping or the name of a metric."""
    plain = Scene(
        name=scene.name,
        title="",
        organ=scene.organ,
        tissue=scene.tissue,
        duration=0.0,
        frames=0,
        checkpoints=scene.checkpoints,
        probed=scene.probed,
        reference=scene.reference,
        obstacles=scene.obstacles,
        held=scene.held,
        gravity=scene.gravity,
    )
    return json.dumps({"scene": json.loads(scene_to_json(plain)), "level": level}, sort_keys=True, ensure_ascii=False)


def reference_fingerprint() -> str:
    """Hash of all code that a reference depends on."""
    return source_fingerprint(
        "reference_fem", "studies.geometry", "studies.adapt", "studies.adapt_reference", "studies.reference"
    )


def reference_path(root: Path, scene: Scene, level: float) -> Path:
    """Where the solution on one mesh lies."""
    return record_path(root, STUDY, f"{scene.name}-{level:g}", reference_key(scene, level))


def reference_is_current(root: Path, scene: Scene, level: float) -> bool:
    """Whether it is there, from this code."""
    path = reference_path(root, scene, level)
    return is_current(path, reference_key(scene, level), reference_fingerprint())


def solve_reference(root: Path, scene: Scene, level: float) -> Path:
    """Solves the scene's load path on one mesh and stores it; a path that breaks off is stored up to there."""
    problem = reference_problem(scene, level)
    status, message = Status.OK, ""
    try:
        found = equilibrium_path(problem, scene.checkpoints)
    except ReferenceProblem as error:
        found = [e for e in getattr(error, "converged", []) if e.t in scene.checkpoints]
        status, message = Status.NOT_CONVERGED, str(error)
    record = new_record(
        kind="reference",
        key=reference_key(scene, level),
        name=f"{scene.name}-{level:g}",
        status=status,
        message=message,
        fingerprint=reference_fingerprint(),
        attributes={"scene": scene.name, "level": float(level), "unknowns": _unknowns(problem)},
        fields=_fields(scene, problem, found),
    )
    path = reference_path(root, scene, level)
    write_record(path, record)
    return path


def _unknowns(problem: Problem) -> int:
    return 3 * len(nodes(problem.mesh)) + problem.mesh.nvertices


def _fields(scene: Scene, problem: Problem, found: list[Equilibrium]) -> dict[str, Field]:
    count = len(scene.checkpoints)
    x, tetrahedra = nodes(problem.mesh), problem.mesh.t.T.astype(np.int64)

    def series(values: list, unit: str, description: str) -> Field:
        """One row per checkpoint; NaN where the path did not get there."""
        shape = np.shape(values[0]) if values else ()
        padded = np.full((count, *shape), np.nan)
        if values:
            padded[: len(values)] = values
        return Field(padded, unit, description)

    contact = [whole_forces(scene, e.obstacle_force[None])[0] for e in found]
    return {
        "t": Field(np.array(scene.checkpoints), "s", "scene time of each equilibrium"),
        "contact_force": series(contact, "N", "force of each obstacle on the body"),
        "held_force": series([e.held_force for e in found], "N", "force of each held region on the body"),
        "volume": series([e.volume / e.volume0 for e in found], "1", "volume over rest volume"),
        "pressure": series(
            [mean_pressure(tetrahedra, e) for e in found], "Pa", "volume mean of the pressure, compression positive"
        ),
        "min_j": series([e.min_J for e in found], "1", "smallest J at a quadrature point"),
        "max_j": series([e.max_J for e in found], "1", "largest J at a quadrature point"),
        "penetration": series([e.penetration for e in found], "m", "deepest penetration of an obstacle"),
        "newton": series([float(e.newton_iterations) for e in found], "1", "Newton iterations"),
        "displacement": series([e.u for e in found], "m", "displacement of the second-order nodes"),
        "nodes": Field(x, "m", "rest positions of the second-order nodes"),
        "tetrahedra": Field(tetrahedra, "1", "vertices of each tetrahedron"),
    }


def mean_pressure(tetrahedra: np.ndarray, equilibrium: Equilibrium) -> float:
    """Volume mean of −p [Pa]: p of the solver is positive in tension, the multiplier of the springs in compression."""
    volume = equilibrium.weights.sum(axis=1)
    return -float(volume @ equilibrium.p[tetrahedra].mean(axis=1) / volume.sum())


@dataclass(frozen=True, eq=False)
class Reference:
    """The solution on the finest mesh; `coarser` is the one it is held against."""

    scene: Scene
    record: Record
    coarser: "Reference | None" = None

    def field(self, name: str) -> np.ndarray:
        """Stored values by name."""
        return self.record.fields[name].values

    @cached_property
    def force(self) -> np.ndarray:
        """The probed force at each checkpoint [N], (K,)."""
        return self.scene.probe(self.field("contact_force"), self.field("held_force"))

    @cached_property
    def mesh(self) -> MeshTet2:
        """The second-order mesh."""
        return MeshTet2(np.ascontiguousarray(self.field("nodes").T), np.ascontiguousarray(self.field("tetrahedra").T))

    @cached_property
    def size(self) -> float:
        """Diagonal of the whole body at rest [m]."""
        return (2.0 if self.scene.symmetric else 1.0) * float(np.linalg.norm(np.ptp(self.field("nodes"), axis=0)))

    @cached_property
    def _evaluator(self) -> Evaluator:
        return Evaluator(self.mesh)

    @cached_property
    def triangles(self) -> np.ndarray:
        """Surface of linear triangles through all second-order nodes, (s, 3)."""
        return surface_triangles(self.mesh)

    def displacement(self, points: np.ndarray, checkpoint: int = -1) -> np.ndarray:
        """Displacement [m] of the material points `points` (m, 3) [m]; of an octant, mirrored.

        Kept for points asked before: metrics of all runs on one mesh ask for the same.
        """
        key = (points.tobytes(), checkpoint)
        if key not in self._known:
            sign = np.where(points < 0, -1.0, 1.0) if self.scene.symmetric else 1.0
            found = self._evaluator.displacement(self.field("displacement")[checkpoint], sign * points)
            self._known[key] = sign * found
        return self._known[key]

    @cached_property
    def _known(self) -> dict[tuple[bytes, int], np.ndarray]:
        return {}

    def surface(self, checkpoint: int = -1) -> tuple[np.ndarray, np.ndarray]:
        """Deformed surface of the whole body: points (n, 3) [m], triangles (s, 3)."""
        points = self.field("nodes") + self.field("displacement")[checkpoint]
        if not self.scene.symmetric:
            return points, self.triangles
        on_cut = np.any(np.all(np.abs(self.field("nodes")[self.triangles]) < 1e-12, axis=1), axis=1)
        part = self.triangles[~on_cut]
        signs = np.array(list(product((1.0, -1.0), repeat=3)))
        faces = [
            part + k * len(points) if s.prod() > 0 else part[:, ::-1] + k * len(points) for k, s in enumerate(signs)
        ]
        return (signs[:, None, :] * points).reshape(-1, 3), np.vstack(faces)

    @cached_property
    def floor(self) -> dict[str, float]:
        """Uncertainty of each quantity [1]: its relative change from the next coarser mesh (docs, eq. 20)."""
        if self.coarser is None:
            raise StudyError(f"the reference of '{self.scene.name}' has one mesh only, so no error bar; solve two")
        points = self.coarser.field("nodes")
        here, there = self.displacement(points), self.coarser.field("displacement")[-1]
        gap = np.linalg.norm(here - there, axis=1)
        reached = gap / np.sqrt((here**2).sum(axis=1).mean())
        outside = self.coarser.triangles
        surface = np.unique(outside)
        return {
            "force": float(np.linalg.norm(self.force - self.coarser.force) / np.linalg.norm(self.force)),
            "force_end": float(abs(self.force[-1] - self.coarser.force[-1]) / abs(self.force[-1])),
            "surface": float(np.sqrt((reached[surface] ** 2).mean())),
            "surface_mean": float(gap[surface].mean() / np.linalg.norm(here[surface], axis=1).max()),
            "interior": float(np.sqrt((reached**2).mean())),
            "silhouette": hausdorff(points + here, outside, points + there, outside) / self.size,
            "volume": float(np.abs(self.field("volume") - 1).max()),
            "pressure": float(abs(self.field("pressure")[-1] / self.coarser.field("pressure")[-1] - 1)),
        }


def load_reference(root: Path, scene: Scene) -> Reference | None:
    """The finest stored solution with the next coarser one behind it; None for a scene without a plan.

    Raises StudyError when one is missing, or did not converge.
    """
    if scene.reference is None:
        return None
    chain: Reference | None = None
    for level in scene.reference.levels[-2:]:
        path = reference_path(root, scene, level)
        record = read_record(path)
        if record.status != Status.OK:
            raise StudyError(f"the reference of '{scene.name}' on mesh {level:g} is {record.status}: {record.message}")
        chain = Reference(scene, record, chain)
    return chain
