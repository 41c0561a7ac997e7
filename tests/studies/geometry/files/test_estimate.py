"""Sizes are estimated from the header, before anything is read."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import read_mesh, scan
from studies.geometry.doctor.examine import examine
from studies.geometry.files.estimate import check_whole, size_warning, triangle_count
from studies.geometry.files.writing import write_mesh


def sparse_stl(path, count, size):
    """A binary STL that says `count` triangles and is `size` bytes long, without using them on the disk."""
    with open(path, "wb") as file:
        file.write(b"solid but binary".ljust(80, b" ") + np.uint32(count).tobytes())
        file.truncate(size)
    return path


def test_ten_million_triangles_are_announced(tmp_path):
    path = sparse_stl(tmp_path / "huge.stl", 10_000_000, 84 + 50 * 10_000_000)
    assert triangle_count(path) == 10_000_000
    assert size_warning(path) == (
        "huge.stl holds about 10,000,000 triangles (500 MB); to read and check it takes about 5 minutes and "
        "23 GB of memory"
    )
    head = tmp_path / "huge.ply"
    head.write_bytes(b"ply\nformat ascii 1.0\nelement vertex 5000002\nelement face 10000000\nend_header\n")
    assert triangle_count(head) == 10_000_000
    text = tmp_path / "huge.obj"
    with open(text, "wb") as file:
        file.truncate(600_000_000)
    assert size_warning(text) is not None
    assert size_warning(sparse_stl(tmp_path / "small.stl", 1000, 50_084)) is None


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj", ".off", ".vtk", ".vtu", ".msh"])
def test_estimates_are_of_the_right_size(tmp_path, balls, suffix):
    mesh = balls[1100].outer()
    path = tmp_path / f"ball{suffix}"
    write_mesh(mesh, path)
    assert 0.25 < triangle_count(path) / len(mesh.triangles) < 4.0
    assert size_warning(path) is None


def test_truncated_binary_stl_is_refused(tmp_path, balls):
    path = tmp_path / "half.stl"
    write_mesh(balls[150].outer(), path)
    check_whole(path)
    path.write_bytes(path.read_bytes()[:3000])
    sentence = r"half.stl is cut short: its header promises 296 triangles in 14,884 bytes, but it has 3,000; copy"
    for read in (read_mesh, scan, examine):
        with pytest.raises(StudyError, match=sentence):
            read(path)


def test_text_stl_is_not_taken_for_a_binary_one(tmp_path, balls):
    points, faces = balls[150].points, balls[150].triangles
    rows = [
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x} {y} {z}\n" for x, y, z in points[f])
        + "endloop\nendfacet\n"
        for f in faces
    ]
    path = tmp_path / "text.stl"
    path.write_text("solid ball\n" + "".join(rows) + "endsolid ball\n")
    check_whole(path)
    assert 0.5 < triangle_count(path) / len(faces) < 2
    assert read_mesh(path).volume == pytest.approx(balls[150].volume, rel=1e-6)
