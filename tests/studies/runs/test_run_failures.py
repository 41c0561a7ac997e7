"""Bad meshes and settings: a failed record with one sentence, never an exception."""

import re
from dataclasses import replace

import numpy as np
import pytest

from massspring import Capsule, Sphere, Trajectory
from studies.geometry import HalfSpace
from studies.runs.recipes import BODIES, SurfaceBody, TetrahedralBody
from studies.runs.run import measure
from studies.scene.scene import Held, Organ
from studies.store.record import Status
from tests.studies.tiny import NODES, SQUEEZE, cube, file_scene, tiny_case, write_obj


def failure(case) -> str:
    """The message of the failed record that a case must leave, one sentence."""
    record = measure(case)
    assert record.status == Status.FAILED
    assert record.fields == {}
    assert record.message
    assert "\n" not in record.message
    return record.message


def box() -> tuple[np.ndarray, np.ndarray]:
    """A closed surface without inner points."""
    points, triangles, _ = cube(2)
    outer = np.unique(triangles)
    return points[outer].copy(), np.searchsorted(outer, triangles)


TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def surfaces():
    """Faults of a surface -> (points, triangles, a word of the sentence)."""
    points, triangles = box()
    moved = points.copy()
    moved[3, 1] = np.nan
    i, j, p, q = *triangles[0, :2], len(points), len(points) + 1
    fin = np.vstack([triangles, [[i, j, p], [j, i, q], [i, p, q], [j, q, p]]])
    return {
        "open": (points, triangles[1:], "open"),
        "inside out": (points, triangles[:, ::-1], "inverted"),
        "not manifold": (np.vstack([points, [[1.0, 1.0, 1.0], [1.0, 1.0, 2.0]]]), fin, "not manifold"),
        "duplicated": (points, np.vstack([triangles, triangles[:1]]), "duplicated"),
        "no volume": (np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]]), TETRAHEDRON, "enclosed volume is zero"),
        "NaN": (moved, triangles, "not finite"),
    }


@pytest.mark.parametrize("fault", surfaces())
@pytest.mark.parametrize("kind", ["tetrahedral", "surface"])
def test_a_bad_surface_fails_in_one_sentence(tmp_path, fault, kind):
    points, triangles, word = surfaces()[fault]
    scene = file_scene(write_obj(tmp_path / "bad.obj", points, triangles))
    message = failure(tiny_case(scene=scene, body=BODIES[kind]()))
    assert message.startswith("bad.obj: ")
    assert word in message


def test_a_good_surface_runs(tmp_path):
    scene = file_scene(write_obj(tmp_path / "good.obj", *box()))
    for kind in ("tetrahedral", "surface"):
        record = measure(tiny_case(scene=scene, body=BODIES[kind]()))
        assert record.status == Status.OK
        fall = (record.fields["snapshots"].values[-1] - record.fields["rest"].values)[:, 2]
        # Symplectic Euler falls ½ g t (t + dt), every node alike.
        expected = -0.5 * 9.81 * 0.01 * (0.01 + record.attributes["dt"])
        np.testing.assert_allclose(fall, expected, rtol=1e-9)


def test_negative_tetrahedra_fail_in_one_sentence(tmp_path):
    meshio = pytest.importorskip("meshio")
    points, _, cells = cube(1)
    cells[2, :2] = cells[2, 1::-1]
    meshio.Mesh(points, [("tetra", cells)]).write(tmp_path / "bad.vtu")
    assert "negative volume" in failure(tiny_case(scene=file_scene(tmp_path / "bad.vtu")))


def test_millimetres_read_as_metres_warn_with_the_box(tmp_path):
    points, triangles = box()
    path = write_obj(tmp_path / "organ.obj", 1000 * points, triangles)
    case = tiny_case(scene=file_scene(path), body=SurfaceBody())
    warning = measure(case).attributes["warnings"]
    assert re.search(r"organ\.obj: the bounding box is 100 x 100 x 100 m; .* unit='mm'", warning)
    right = tiny_case(scene=file_scene(path, unit="mm"), body=SurfaceBody())
    record = measure(right)
    assert (record.status, record.attributes["warnings"]) == (Status.OK, "")


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"scene": file_scene("/nowhere/organ.stl")}, "no mesh file"),
        (
            {"scene": replace(file_scene("organ.stl"), organ=replace(SQUEEZE.organ, shape="file"))},
            "unknown parameter of an organ from a file 'radius'",
        ),
        (
            {"scene": replace(file_scene("organ.stl"), organ=Organ("file"))},
            "a path and a unit",
        ),
        ({"scene": file_scene("organ.stl", unit="inch")}, "'inch' is not known"),
        ({"scene": replace(SQUEEZE, organ=replace(SQUEEZE.organ, shape="bal"))}, "did you mean 'ball'"),
        ({"scene": replace(SQUEEZE, damping=-1.0)}, "damping is -1"),
        ({"scene": replace(SQUEEZE, duration=0.0)}, "positive duration"),
        ({"scene": replace(SQUEEZE, gravity=(0.0, 0.0, float("nan")))}, "gravity is (0.0, 0.0, nan)"),
        ({"scene": replace(SQUEEZE, obstacles=(Sphere((0.0, 0.0, 0.0), 1e-3),))}, "0.001 m inside the body"),
        (
            {"scene": replace(SQUEEZE, obstacles=(Capsule((0.0, 0.0, 0.02), (0.0, 0.0, 0.3), 1e-3),))},
            "0.001 m inside the body",
        ),
        ({"dt": 1.0}, "lies above the stability limit of"),
        ({"dt_fraction": 1.2, "frames": 100}, "set beyond_limit to see the run diverge"),
        ({"body": TetrahedralBody(nodes=NODES, volumes="regions", regions=90)}, "more volumes than nodes lock it"),
        ({"body": TetrahedralBody(nodes=0)}, "nodes"),
        ({"body": TetrahedralBody(nodes=NODES, stiffness=0.0)}, "stiffness factor is 0"),
        (
            {"scene": replace(SQUEEZE, obstacles=(replace(SQUEEZE.obstacles[0], point=(0.0, 0.0, 0.0)),))},
            "inside the body",
        ),
    ],
)
def test_bad_settings_fail_in_one_sentence(changes, word):
    assert word in failure(tiny_case(**changes))


def test_attachments_that_overlap_or_miss_fail_in_one_sentence(tmp_path):
    """A mesh from a file has no outlines: the region is looked for among its nodes."""
    path = write_obj(tmp_path / "box.obj", *box())
    top = Held("top", HalfSpace((0.0, 0.0, 0.04), (0.0, 0.0, -1.0)), Trajectory())
    far = Held("far", HalfSpace((0.0, 0.0, 9.0), (0.0, 0.0, -1.0)))
    body = SurfaceBody()
    assert measure(tiny_case(scene=file_scene(path, held=(top,)), body=body)).status == Status.OK
    assert "same node" in failure(tiny_case(scene=file_scene(path, held=(top, replace(top, name="again"))), body=body))
    assert "holds no node" in failure(tiny_case(scene=file_scene(path, held=(far,)), body=body))
