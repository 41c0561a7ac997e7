"""Meshes written come back, whole or not at all."""

import os

import meshio
import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import curved, organ, read_mesh
from studies.geometry.files.writing import SURFACES, TAGS, VOLUMES, check_target, write_mesh


@pytest.mark.parametrize("suffix", [*VOLUMES, *SURFACES])
def test_every_format_comes_back(tmp_path, livers, suffix, capfd):
    mesh = livers[150]
    path = tmp_path / f"liver{suffix}"
    write_mesh(mesh, path, unit="mm")
    assert capfd.readouterr() == ("", "") and os.listdir(tmp_path) == [path.name]
    back = read_mesh(path, unit="mm")
    solid = suffix in VOLUMES
    assert back.surface_count == 150 and len(back.triangles) == len(mesh.triangles)
    assert len(back.tetrahedra) == (len(mesh.tetrahedra) if solid else 0)
    # STL keeps single precision, OBJ and OFF some digits of text.
    exact = suffix in (*VOLUMES, ".ply")
    assert back.volume == pytest.approx(mesh.volume, rel=1e-12 if exact else 1e-5)
    if exact:
        held = back.points[back.patches["bare_area"]]
        expected = mesh.points[mesh.patches["bare_area"]]
        assert np.abs(held[np.lexsort(held.T)] - expected[np.lexsort(expected.T)]).max() < 1e-12


def test_hollow_organs_keep_their_parts(tmp_path):
    mesh = organ("bladder", 300)
    path = tmp_path / "bladder.vtu"
    write_mesh(mesh, path)
    raw = meshio.read(path)
    triangles, tissue = raw.cell_data["part"]
    assert (np.bincount(triangles) == [0, len(mesh.outer_triangles), len(mesh.lumen_triangles)]).all()
    assert (tissue == TAGS["tissue"]).all()
    assert read_mesh(path).volume == pytest.approx(mesh.volume, rel=1e-12)


def test_curved_meshes_are_written_in_their_order(tmp_path, balls):
    mesh = balls[150]
    bent = curved(mesh)
    path = tmp_path / "ball.vtu"
    write_mesh(mesh, path, curved=bent)
    raw = meshio.read(path)
    assert (raw.cells_dict["tetra10"] == bent.cells).all() and (raw.points == bent.points).all()
    with pytest.raises(StudyError, match=r"ball.stl: .stl holds flat triangles only; write a curved mesh as .vtu"):
        write_mesh(mesh, tmp_path / "ball.stl", curved=bent)


def test_targets_that_cannot_be(tmp_path, balls):
    source = tmp_path / "scan.stl"
    source.write_text("kept")
    with pytest.raises(StudyError, match="is the file that is read, and it stays as it is"):
        check_target(tmp_path / "." / "scan.stl", source)
    with pytest.raises(StudyError, match=r"out.xyz: meshes are written as .vtu, .vtk, .msh, .stl, .ply, .obj, .off"):
        write_mesh(balls[150], tmp_path / "out.xyz")
    with pytest.raises(StudyError, match="is a folder"):
        (tmp_path / "d.vtu").mkdir()
        check_target(tmp_path / "d.vtu")
    with pytest.raises(StudyError, match="was not written"):
        write_mesh(balls[150], source / "below.vtu")
    with pytest.raises(StudyError, match="unit 'ft' is not known"):
        write_mesh(balls[150], tmp_path / "out.vtu", unit="ft")
    assert source.read_text() == "kept" and sorted(os.listdir(tmp_path)) == ["d.vtu", "scan.stl"]
