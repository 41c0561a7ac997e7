"""What is given to other programs: the scene, and the straight and the curved mesh of its organ.

A scene with a cut is for programs that cannot cut: its meshes are cut from the start, and only checkpoints after the
cut count. The tissue has no memory, so an equilibrium after the cut does not depend on when it was made.
"""

import hashlib
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from massspring import Body
from massspring.body.volumes import Volumes
from massspring.layout.face_pairs import faces_behind
from studies.base.errors import StudyError
from studies.geometry import OrganMesh
from studies.geometry.mesh.organ_mesh import boundary_triangles
from studies.meshing.graded_mesh import mesh_at
from studies.meshing.opened_mesh import opened_mesh
from studies.meshing.quadratic_mesh import QuadraticMesh
from studies.meshing.scene_mesh import mesh_for, patch_nodes
from studies.reference.load import Reference
from studies.runs.cutting import pieces_of
from studies.runs.prepare import LUMEN, body_for
from studies.runs.recipes import BodyRecipe, QuadraticBody, TetrahedralBody
from studies.scene.scene import Scene
from studies.store.schema import REFERENCE_FIELDS

STRAIGHT, CURVED = "straight", "curved"
NODES = 550
"""Default number of vertices on the outer surface."""
GRAIN = 1e-7
"""Rounding of rest positions before they are hashed [m]: far above round-off, far below an edge."""


def given_scene(scene: Scene) -> Scene:
    """The scene for another program; for a scene with a cut, only with the checkpoints after it.

    Raises StudyError for a cut whose time matters: one in a scene without equilibria, one that allows free pieces, or
    one that opens a lumen; for several cuts, and for one after which there is no checkpoint.
    """
    if len(scene.cuts) > 1:
        raise StudyError(
            f"scene '{scene.name}' cannot be given away cut from the start: it has {len(scene.cuts)} cuts, and files "
            "and words of an export are of one"
        )
    cut = scene.cut
    if cut is None:
        return scene
    if cut.free or scene.start is not None:
        what = f"cut '{cut.name}' lets a piece go" if cut.free else "it starts in motion"
        raise StudyError(f"scene '{scene.name}' cannot be given away cut from the start: {what}, so its time matters")
    if cut.opens_lumen:
        raise StudyError(
            f"scene '{scene.name}' cannot be given away cut from the start: cut '{cut.name}' opens a lumen, whose "
            "volume is kept until then"
        )
    after = tuple(t for t in scene.checkpoints if t > cut.ends)
    if not after:
        raise StudyError(
            f"scene '{scene.name}' has no checkpoint after its cut '{cut.name}' at {cut.ends:g} s; add one"
        )
    return replace(scene, checkpoints=after)


def reference_of(scene: Scene, reference: Reference | None) -> Reference | None:
    """The reference of a scene at the checkpoints of the same scene as given_scene has it."""
    count = len(scene.checkpoints)
    if reference is None or count == len(reference.scene.checkpoints):
        return reference
    fields = dict(reference.record.fields)
    for name, stored in fields.items():
        lengths = REFERENCE_FIELDS[name].shape.split()
        if "K" in lengths:
            late = np.take(stored.values, range(-count, 0), axis=lengths.index("K"))
            fields[name] = replace(stored, values=late)
    return Reference(scene, replace(reference.record, fields=fields))


@dataclass(frozen=True, eq=False)
class GivenMesh:
    """A mesh of a scene's organ, opened where the scene cuts it, and the body by which it is measured."""

    scene: Scene
    kind: str
    """STRAIGHT: linear tetrahedra; CURVED: quadratic ones, on the true surface where it is known."""
    mesh: OrganMesh | QuadraticMesh
    outer_count: int
    """Nodes of the outer surface before the cut."""
    pairs: np.ndarray = field(default_factory=lambda: np.empty((0, 2), np.int64))
    """Nodes behind the cut and in front of it, (p, 2)."""

    @property
    def points(self) -> np.ndarray:
        """Rest positions [m], (n, 3)."""
        return self.mesh.points

    @property
    def cells(self) -> np.ndarray:
        """Nodes of the tetrahedra in VTK's order, (k, 4) or (k, 10)."""
        return self.mesh.cells if isinstance(self.mesh, QuadraticMesh) else self.mesh.tetrahedra

    @cached_property
    def digest(self) -> str:
        """SHA-256 of rest positions, rounded to GRAIN, and cells."""
        points = np.round(self.points / GRAIN).astype("<i8")
        return hashlib.sha256(points.tobytes() + self.cells.astype("<i8").tobytes()).hexdigest()

    @cached_property
    def recipe(self) -> BodyRecipe:
        """Of the body: its nodes are those of the outer surface before the cut."""
        return (QuadraticBody if self.kind == CURVED else TetrahedralBody)(self.outer_count)

    @cached_property
    def body(self) -> Body:
        """The masses, triangles and tetrahedra by which it is measured."""
        return body_for(self.scene, self.recipe, self.mesh)

    @cached_property
    def volumes(self) -> Volumes:
        """The measured volumes: that of the tissue or of each of its pieces, and that of a filled lumen."""
        if self.scene.cuts:
            cells = self.body.tetrahedra.astype(np.int64)
            piece = pieces_of(self.points, cells)
            surfaces = {f"piece {k}": boundary_triangles(cells[piece == k]) for k in range(piece.max() + 1)}
            return Volumes.closed_surfaces(self.body, surfaces)
        kept = self.body.kept
        if isinstance(kept, Volumes):
            return kept
        if not self.scene.filled:
            return Volumes.whole(self.body)
        inner = (self.body.triangles >= self.mesh.outer_count).all(axis=1)
        surfaces = {"wall": self.body.triangles, LUMEN: self.body.triangles[inner][:, ::-1]}
        return Volumes.closed_surfaces(self.body, surfaces)

    @property
    def cut_facets(self) -> np.ndarray:
        """Boundary facets behind the cut and those at the same places in front of it, whose nodes have the same order,
        (f, 2, 3) or (f, 2, 6)."""
        mesh, n = self.mesh, len(self.points)
        facets = mesh.facets if isinstance(mesh, QuadraticMesh) else mesh.triangles
        behind = faces_behind(facets.astype(np.int64), self.pairs, n)
        front = np.arange(n)
        front[self.pairs[:, 0]] = self.pairs[:, 1]
        return np.stack([behind, front[behind]], axis=1)

    def held_nodes(self) -> dict[str, np.ndarray]:
        """The nodes of each held region."""
        mesh = self.mesh
        if isinstance(mesh, QuadraticMesh):
            return {held.name: mesh.patches[held.name] for held in self.scene.held}
        return {held.name: patch_nodes(mesh, held.name, held.region) for held in self.scene.held}

    def volume_targets(self, t: np.ndarray) -> np.ndarray:
        """What each measured volume should be at times t (F,) [s], (F, m) [m³]."""
        lumen = self.scene.lumen
        filling = np.ones(len(t)) if lumen is None else lumen.filling(t)
        factors = [filling if name == LUMEN else np.ones(len(t)) for name in self.volumes.names]
        return np.column_stack(factors) * self.volumes.measure(self.points)


def given_mesh(scene: Scene, nodes: int, kind: str) -> GivenMesh:
    """The mesh of a kind with `nodes` vertices on its outer surface. Raises StudyError where it cannot be made."""
    made = mesh_for(scene, nodes) if kind == STRAIGHT else mesh_at(scene, nodes, 0, 0, True)
    assert isinstance(made, QuadraticMesh) == (kind == CURVED)
    if not scene.cuts:
        return GivenMesh(scene, kind, made, int(made.outer_count))
    after = opened_mesh(made)
    return GivenMesh(scene, kind, after.mesh, int(made.outer_count), after.pairs)


def given_meshes(scene: Scene, nodes: int) -> tuple[list[GivenMesh], str]:
    """The straight mesh and, where it can be made, the curved one; and why there is no curved one.

    Raises StudyError where not even the straight one can be made.
    """
    straight = given_mesh(scene, nodes, STRAIGHT)
    try:
        return [straight, given_mesh(scene, nodes, CURVED)], ""
    except StudyError as problem:
        return [straight], str(problem)
