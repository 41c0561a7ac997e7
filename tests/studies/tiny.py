"""The smallest scenes, cases and studies that still do what the real ones do."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from massspring import Free, ImplicitVolume
from studies.catalog import Study
from studies.geometry.mesh.organ_mesh import boundary_triangles
from studies.runs.case import Case
from studies.runs.recipes import TetrahedralBody
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.scene.scene import Organ, Scene
from studies.store.ledger import Ledger
from studies.sweep.job import CaseJob

NODES, FRAMES = 60, 5
SQUEEZE = replace(BALL_SQUEEZE, name="tiny_squeeze", reference=None, checkpoints=(0.8, 1.6, 2.4, 4.0))
MESHED = ("ball", "liver", "bladder")
"""Organs that every run of the tests meshes for their scenes: a free one, a held one, a hollow one."""
CUBE = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
"""Kuhn's six tetrahedra of a cube whose corner (x, y, z) has number x + 2 y + 4 z; neighbours match."""
TINY = """
from studies.catalog import Chart
from tests.studies.tiny import tiny_study

def draw(runs, path):
    path.write_text(f"{len(runs)} runs")

STUDY = tiny_study(charts=(Chart("picture.txt", draw),))
"""
"""A study file as a user would write it."""


class Silent:
    """Progress without a display; remembers the messages."""

    def __init__(self):
        self.begun: list[tuple[str, int]] = []
        self.done: list[tuple[str, str]] = []

    def begin(self, what, total):
        self.begun.append((what, total))

    def advance(self, what, note):
        self.done.append((what, note))


def tiny_case(**changes) -> Case:
    """60 surface nodes, 5 frames, no reference."""
    return Case(SQUEEZE, TetrahedralBody(NODES), ImplicitVolume(), frames=FRAMES).replaced(**changes)


def tiny_study(**changes) -> Study:
    """Both methods timed, and one case that diverges."""
    cases = (tiny_case(timed=True), tiny_case(method=Free(), timed=True), diverging_case())
    study = Study("tiny", "Does it run?", cases, (), ("volume_worst", "step_time"), expects=("diverged",))
    return replace(study, **changes)


def diverging_case() -> Case:
    """Three times the stability limit."""
    return tiny_case(dt_fraction=3.0, beyond_limit=True, timed=True)


def bodies_of(scenes: Iterable[Scene], only: Sequence[Scene] = (BALL_SQUEEZE,)) -> list:
    """Parameters (scene, kind of body): tetrahedra in every scene, the surface where it costs no mesh of its own.

    That is in `only`, and in hollow organs, whose surface body has the mesh of the wall; in others it is a campaign,
    as are the organs that are not MESHED.
    """
    rows = []
    for scene in scenes:
        for kind, quick in (("tetrahedral", True), ("surface", scene in only or scene.lumen is not None)):
            marks = () if quick and quick_to_mesh(scene) else pytest.mark.campaign
            rows.append(pytest.param(scene, kind, id=f"{scene.name}-{kind}", marks=marks))
    return rows


def quick_to_mesh(scene: Scene) -> bool:
    """Whether every run of the tests meshes the organ of a scene."""
    return scene.organ.shape in MESHED


def cube(cells: int = 2, edge: float = 0.1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3) [m], outward triangles, tetrahedra of a cube around the origin."""
    side = cells + 1
    z, y, x = np.meshgrid(*(np.arange(side),) * 3, indexing="ij")
    points = edge * (np.stack([x, y, z], axis=-1).reshape(-1, 3) / cells - 0.5)
    number = np.arange(side**3).reshape(side, side, side)
    corners = [
        number[k : k + cells, j : j + cells, i : i + cells].ravel() for k in (0, 1) for j in (0, 1) for i in (0, 1)
    ]
    tetrahedra = np.stack(corners, axis=1)[:, CUBE].reshape(-1, 4)
    return points, boundary_triangles(tetrahedra), tetrahedra


def write_obj(path, points, triangles):
    """A surface as Wavefront OBJ, digit for digit."""
    lines = ["v " + " ".join(repr(float(c)) for c in p) for p in points]
    lines += ["f " + " ".join(str(int(i) + 1) for i in t) for t in triangles]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def file_scene(path, unit: str = "m", **changes) -> Scene:
    """A body from a mesh file that falls for a moment: nothing about it but the mesh can go wrong."""
    scene = replace(
        SQUEEZE,
        name="from_file",
        organ=Organ("file", {"path": str(path), "unit": unit}),
        obstacles=(),
        duration=0.01,
        checkpoints=(0.01,),
        gravity=(0.0, 0.0, -9.81),
        damping=0.0,
    )
    return replace(scene, **changes)


def why_stale(root, case: Case, study: str = "tiny") -> str | None:
    """What a new ledger of `root` answers for a case."""
    return Ledger(root).why(CaseJob(root, study, case))


def content(folder) -> dict:
    """Every file below a folder, by relative path, byte for byte."""
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
