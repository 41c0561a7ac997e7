"""Meshes from files: any format, welded, in metres, checked."""

import warnings

import meshio
import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import attach, check_tetrahedra, fill, read_mesh
from studies.geometry.mesh.quality import dihedral_angles
from studies.geometry.shape.regions import BallRegion
from tests.studies.geometry.real import real_surface


def write(path, points, **cells):
    meshio.write_points_cells(path, points, [(kind, data) for kind, data in cells.items()])
    return path


@pytest.fixture(scope="module")
def surface(balls):
    """Points [m] and triangles of a ball of 150 nodes."""
    mesh = balls[150]
    return mesh.points[:150], mesh.triangles


def test_points_keep_their_order_and_unused_ones_go(tmp_path, surface):
    points, triangles = surface
    extra = np.vstack([[[9.0, 9, 9]], points])
    mesh = read_mesh(write(tmp_path / "b.vtu", extra, triangle=triangles + 1))
    assert (mesh.points == points).all() and (mesh.triangles == triangles).all()


def test_points_within_rounding_of_each_other_are_one(tmp_path, surface):
    points, triangles = surface
    corners = points[triangles].reshape(-1, 3)
    corners += np.random.default_rng(3).uniform(-2e-10, 2e-10, corners.shape)  # size 0.17 m, single precision 1e-8 m
    loose = write(tmp_path / "loose.vtu", corners, triangle=np.arange(len(corners)).reshape(-1, 3))
    assert read_mesh(loose).surface_count == 150


def test_quadrilaterals_are_cut_in_two(tmp_path):
    points = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float) * 0.1
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    mesh = read_mesh(write(tmp_path / "cube.obj", points, quad=np.array(quads)))
    assert len(mesh.triangles) == 12 and mesh.volume == pytest.approx(1e-3, rel=1e-12)


def test_body_keeps_its_tetrahedra_and_gets_its_surface_first(tmp_path, balls):
    body = balls[150]
    order = np.random.default_rng(1).permutation(len(body.points))
    place = np.argsort(order)
    mesh = read_mesh(write(tmp_path / "b.vtu", body.points[order], tetra=place[body.tetrahedra]))
    check_tetrahedra(mesh.points, mesh.tetrahedra)
    assert mesh.surface_count == 150 and mesh.triangles.max() == 149 and len(mesh.triangles) == 296
    assert mesh.volume == pytest.approx(body.volume, rel=1e-12)


def test_inside_out_is_refused_and_flipped_on_request(tmp_path, balls, surface):
    points, triangles = surface
    path = write(tmp_path / "b.ply", points, triangle=triangles[:, ::-1])
    with pytest.raises(StudyError, match=r"b\.ply: the surface is inverted"):
        read_mesh(path)
    assert read_mesh(path, flip=True).volume == pytest.approx(balls[150].volume, rel=1e-6)
    body = balls[150]
    path = write(tmp_path / "b.vtu", body.points, tetra=body.tetrahedra[:, [1, 0, 2, 3]])
    with pytest.raises(StudyError, match="negative volume"):
        read_mesh(path)
    assert read_mesh(path, flip=True).volume == pytest.approx(body.volume, rel=1e-12)


def test_millimetres_in_a_metre_scene_are_suspected(tmp_path, surface):
    points, triangles = surface
    path = write(tmp_path / "b.vtu", 1e3 * points, triangle=triangles)
    with pytest.warns(
        UserWarning, match=r"bounding box is \d+\.?\d* x .* m; if the file is in millimetres, say unit='mm'"
    ):
        read_mesh(path)
    with pytest.warns(UserWarning, match="if the file is in metres"):
        read_mesh(write(tmp_path / "c.vtu", 1e-3 * points, triangle=triangles), unit="cm")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_allclose(read_mesh(path, unit="mm").points, points, rtol=1e-12)


def test_what_is_no_mesh_gets_a_sentence(tmp_path, surface, capfd):
    points, triangles = surface
    text = tmp_path / "notes.stl"
    text.write_text("this is not a mesh at all\n")
    empty = tmp_path / "empty.ply"
    empty.write_bytes(b"")
    odd = tmp_path / "body.xyz"
    odd.write_text("1 2 3\n")
    nan = points.copy()
    nan[3] = np.nan
    cases = {
        "there is no mesh file": tmp_path / "missing.stl",
        r"notes\.stl": text,
        r"empty\.ply is not a mesh that can be read": empty,
        r"body\.xyz is not a mesh that can be read": odd,
        "1 points are not finite": write(tmp_path / "nan.vtu", nan, triangle=triangles),
        "open": write(tmp_path / "open.ply", points, triangle=triangles[3:]),
        "no triangles and no tetrahedra": write(tmp_path / "line.vtu", points, line=triangles[:, :2]),
        "degenerate": write(tmp_path / "twice.vtu", points, triangle=np.vstack([triangles, [[0, 0, 1]]])),
    }
    capfd.readouterr()
    for sentence, path in cases.items():
        with pytest.raises(StudyError, match=sentence) as caught:
            read_mesh(path)
        assert "\n" not in str(caught.value)
        assert capfd.readouterr() == ("", "")  # the reader's own output is not shown
    with pytest.raises(StudyError, match="unit 'inch' is not known; use one of m, cm, mm"):
        read_mesh(text, unit="inch")


def test_fill_refuses_what_it_cannot_fill(surface, tmp_path):
    points, triangles = surface
    doubled = np.vstack([points, points + np.array([0.2, 0.0, 0.0])])
    parts = read_mesh(write(tmp_path / "two.vtu", doubled, triangle=np.vstack([triangles, triangles + 150])))
    with pytest.raises(StudyError, match=r"two: the surface has 2 separate parts"):
        fill(parts)
    pushed = points.copy()
    far = np.argmax(points[:, 0])
    pushed[far, 0] -= 0.13  # one node pushed out through the opposite side
    crossing = read_mesh(write(tmp_path / "cross.vtu", pushed, triangle=triangles))
    with pytest.raises(StudyError, match="could not be filled"):
        fill(crossing)


@pytest.mark.parametrize("name", ["liver_hra_552", "stomach_bp3d_542"])
def test_real_organs_become_bodies(name):
    mesh = read_mesh(real_surface(name), unit="mm")
    assert 1e-4 < mesh.volume < 2.5e-3
    body = fill(mesh)
    check_tetrahedra(body.points, body.tetrahedra)
    assert (body.points[: body.surface_count] == mesh.points).all() and (body.triangles == mesh.triangles).all()
    assert dihedral_angles(body.points, body.tetrahedra).min() > 8.0
    held = attach(body, {"top": BallRegion(tuple(mesh.points[mesh.points[:, 2].argmax()]), 0.03)})
    assert 3 <= len(held.patches["top"]) < mesh.surface_count // 2
