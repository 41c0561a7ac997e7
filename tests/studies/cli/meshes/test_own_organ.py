"""The page "your own organ" is followed line by line, on a synthetic organ written as a damaged scan."""

import importlib.util
import re
import shlex
from pathlib import Path

import meshio
import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import OrganMesh, organ, read_mesh
from studies.runs.run import measure
from studies.scene.meshing import mesh_for
from studies.scene.proposal import HELD, proposal
from studies.store.record import Status
from tests.geometry.boxes import box, split, together

PAGE = Path(__file__).parents[4] / "docs" / "own-organ.md"
COMMANDS = re.findall(r"^    organbench (.+)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
CODES = {"check scan.ply": 1}
"""Exit codes other than 0."""


@pytest.fixture(scope="module")
def kidney(mesh_cache):
    """The organ that hides in the scan."""
    return organ("kidney", 1000, fill=False, exact=True)


@pytest.fixture
def scan_file(kidney, tmp_path, monkeypatch):
    """A damaged scan of it in the current folder: millimetres, a speck, some triangles turned, a few missing."""
    faces = kidney.triangles.copy()
    faces[100:160] = faces[100:160, ::-1]
    low = kidney.points[faces].mean(axis=1)[:, 2].argsort()
    faces = np.delete(faces, low[:3], axis=0)
    speck = box((0.2, 0.2, 0.2), (0.203, 0.203, 0.203))
    points, faces = together((kidney.points, faces), speck)
    monkeypatch.chdir(tmp_path)
    meshio.write_points_cells("scan.ply", 1e3 * points, [("triangle", faces.astype(np.int32))])
    return tmp_path / "scan.ply"


def test_the_page_is_followed(organbench, scan_file, kidney):
    folder = scan_file.parent
    assert [line.split()[0] for line in COMMANDS] == ["check", "mesh", "check", "place", "run", "status"]
    for line in COMMANDS:
        code, out, err = organbench(*shlex.split(line))
        assert code == CODES.get(line, 0), f"organbench {line}: {out}{err}"
    body = read_mesh(folder / "body.vtu")
    assert len(body.tetrahedra) and body.volume == pytest.approx(kidney.volume, rel=5e-3)
    assert (folder / "my_scene.png").stat().st_size > 10_000
    scene_file = loaded(folder / "my_scene.py")
    case = scene_file.CASE.replaced(frames=20)
    record = measure(case)
    assert record.status == Status.OK, record.message
    # Held alike on every mesh: the outline of the region is on the edges.
    region = case.scene.regions["end"]
    for nodes in (200, 300):
        mesh = mesh_for(case.scene, nodes)
        level = region.level(mesh.points[: mesh.surface_count])[mesh.triangles]
        assert not ((level > 1e-8).any(axis=1) & (level < -1e-8).any(axis=1)).any()
        assert mesh.volume == pytest.approx(body.volume, rel=2e-3)


def loaded(path):
    """A scene file as a module."""
    spec = importlib.util.spec_from_file_location("my_scene", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def body_of(points, faces):
    return OrganMesh("egg", points, faces, np.empty((0, 4), np.int64), len(points))


def egg(taper=0.0):
    """60 x 50 x 40 mm; a taper makes the end at high x thinner."""
    points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=4)
    unit = points / np.linalg.norm(points, axis=1, keepdims=True)
    unit[:, 1:] *= 1 - taper * unit[:, :1]
    return 1e-3 * unit * (30, 22, 15), faces


def test_axes_hold_and_palpation_follow_the_rules():
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    points, faces = egg(taper=0.4)
    found = proposal(body_of(points @ turn.T + 0.3, faces))
    axis = np.asarray(found.axes[0])
    assert abs(axis @ turn[:, 0]) > 0.999 and found.sides[0] == pytest.approx(0.060, rel=0.01)
    # The blunter end is at low x; a tenth of the surface is held there, and the normal looks to the middle.
    assert np.asarray(found.hold.normal) @ turn[:, 0] > 0.999 and found.held_share == pytest.approx(HELD, abs=0.01)
    assert (found.hold.level(np.array([turn @ (-0.030, 0, 0) + 0.3])) < 0).all()
    point, normal = (np.asarray(v) for v in (found.palpation.point, found.palpation.normal))
    assert found.hold.level(point[None])[0] > 0.4 * found.sides[0]
    # The flattest side of the egg is that of its shortest axis; nothing of the body lies beyond.
    assert abs(normal @ turn[:, 2]) > 0.9 and ((points @ turn.T + 0.3 - point) @ normal).max() < 0.0015


def test_a_body_without_a_free_patch_is_told():
    points, faces = egg()
    inside_out = body_of(points, faces[:, ::-1])
    with pytest.raises(StudyError, match="egg: no freely reachable patch lies far from its held end"):
        proposal(inside_out)


def test_bad_input_is_one_sentence(refused, scan_file, tmp_path):
    cases = {
        ("place", "scan.ply", "--unit", "mm", "-o", "scene.txt"): "a scene file is Python",
        ("place", "scan.ply", "--unit", "mm", "--picture", "a.jpg"): "the picture is a PNG",
        ("place", "none.ply", "--unit", "mm"): "there is no mesh file",
    }
    before = sorted(p.name for p in tmp_path.iterdir())
    for words, told in cases.items():
        assert told in refused(*words)
        assert sorted(p.name for p in tmp_path.iterdir()) == before
