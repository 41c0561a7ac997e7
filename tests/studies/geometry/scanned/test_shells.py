"""Thin shells and open surfaces become the bodies that they enclose."""

import meshio
import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import check_surface, scan
from studies.geometry.doctor.examine import examine
from studies.geometry.mesh.organ_mesh import signed_volume
from tests.studies.geometry.boxes import box, split, together

MM = 1e-3
AXES = np.array((30.0, 25.0, 20.0))
BALL = split(*box((-1, -1, -1), (1, 1, 1)), times=4)
UNIT = BALL[0] / np.linalg.norm(BALL[0], axis=1, keepdims=True)
OUTER = AXES * UNIT
VOLUME = 1e-9 * signed_volume(OUTER, BALL[1])
FLAT = {"nodes": 300, "unit": "mm", "fill": False}


def stored(path, points, faces):
    meshio.write_points_cells(path, points, [("triangle", np.asarray(faces, np.int32))])
    return path


@pytest.fixture(scope="module")
def capsule(tmp_path_factory):
    """Two sheets 0.5 mm apart, joined round an opening of 6 mm: closed, and next to nothing inside."""
    faces = BALL[1][
        (OUTER[BALL[1]].mean(axis=1)[:, 2] < 0) | (np.linalg.norm(OUTER[BALL[1]].mean(axis=1)[:, :2], axis=1) > 3)
    ]
    points, both = together((OUTER, faces), ((AXES - 0.5) * UNIT, faces[:, ::-1]))
    half = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges = {tuple(edge) for edge in half.tolist()}
    rim = np.array([edge for edge in half.tolist() if (edge[1], edge[0]) not in edges])
    i, j, n = rim[:, 0], rim[:, 1], len(OUTER)
    lips = np.vstack([np.column_stack([j, i, i + n]), np.column_stack([j, i + n, j + n])])
    used, faces = np.unique(np.vstack([both, lips]), return_inverse=True)
    return stored(tmp_path_factory.mktemp("capsule") / "capsule.ply", points[used], faces.reshape(-1, 3))


@pytest.mark.filterwarnings("ignore:.*the mesh has a part here that the file does not")
def test_a_capsule_is_a_finding_and_the_way_out_works(capsule):
    findings = {finding.code: finding for finding in examine(capsule, unit="mm").findings}
    assert "0.49 mm thick" in findings["shell"].sentence or "0.5 mm thick" in findings["shell"].sentence
    assert "--solid" in findings["shell"].mend
    body = scan(capsule, solid=0.008, **FLAT)
    check_surface(body.points, body.triangles)
    assert body.volume == pytest.approx(VOLUME, rel=0.04) and body.losses["volume_file"] == pytest.approx(
        VOLUME, rel=0.04
    )
    assert body.losses["file_to_mesh"]["max"] < 0.03 * body.losses["diagonal"]


@pytest.mark.campaign
@pytest.mark.filterwarnings("ignore:.*the mesh has a part here that the file does not")
def test_a_surface_with_a_hole_is_filled_too(tmp_path):
    faces = BALL[1][OUTER[BALL[1]].mean(axis=1)[:, 2] < 19.5]
    path = stored(tmp_path / "open.ply", OUTER, faces)
    with pytest.raises(StudyError, match="the surface is open"):
        scan(path, **FLAT)
    assert scan(path, solid=0.015, **FLAT).volume == pytest.approx(VOLUME, rel=0.04)


def test_a_surface_that_encloses_nothing_is_refused(tmp_path):
    faces = BALL[1][OUTER[BALL[1]].mean(axis=1)[:, 2] < -5]  # a bowl
    path = stored(tmp_path / "bowl.ply", OUTER, faces)
    with pytest.raises(StudyError, match=r"bowl: the surface encloses nothing when openings up to 3 mm are closed"):
        scan(path, solid=0.003, **FLAT)
    with pytest.raises(StudyError, match="cannot close openings of -1 mm"):
        scan(path, solid=-0.001, **FLAT)


def test_no_organ_is_taken_for_a_shell(livers):
    assert "shell" not in [finding.code for finding in examine(livers[550]).findings]
    assert examine(livers[550]).measures["thickness"] > 0.05 * examine(livers[550]).measures["diagonal"]
