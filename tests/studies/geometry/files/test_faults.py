"""Damaged files of every format: a mesh or one sentence in words, at once, never the name of a Python type."""

import os
import re
import warnings

import meshio
import nibabel
import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import read_mesh, scan
from studies.geometry.doctor.examine import examine
from studies.geometry.files.faults import size_warning
from studies.geometry.files.opening import opened
from studies.geometry.files.units import Source
from studies.geometry.mesh.organ_mesh import signed_volume
from tests.studies.geometry.boxes import box, split
from tests.studies.geometry.files import writers

POINTS, FACES = split(*box((-0.03, -0.02, -0.01), (0.03, 0.02, 0.01)), times=1)
PYTHON = re.compile(r"\w+Error\b|\w+Exception\b|SystemExit|Traceback|<class|object at 0x|NoneType|ndarray")
MANY = (4_000_000_000, 2**32 - 1)


def whole(folder):
    """A sound file of each format, by its name."""
    made = {}
    for suffix in ("ply", "off", "vtu", "vtk", "msh"):
        path = folder / f"whole.{suffix}"
        meshio.write_points_cells(path, POINTS, [("triangle", FACES)])
        made[suffix] = path.read_bytes()
    for name, binary in (("stl", True), ("text.stl", False)):
        path = folder / f"whole.{name}"
        meshio.write_points_cells(path, POINTS, [("triangle", FACES)], file_format="stl", binary=binary)
        made[name] = path.read_bytes()
    made["obj"] = writers.obj([("one", POINTS, FACES)])
    made["poly.vtk"] = writers.legacy_vtk(POINTS, FACES, binary=True)
    made["text.vtk"] = writers.legacy_vtk(POINTS, FACES, binary=False, modern=True)
    for mode in ("text", "packed", "raw"):
        made[f"{mode}.vtp"] = writers.vtp(POINTS, FACES, mode)
    made["glb"] = writers.glb([("one", POINTS, FACES, (0, 0, 0))])
    labels = np.zeros((12, 12, 12), np.uint8)
    labels[3:9, 3:9, 3:9] = 1
    path = folder / "whole.nii"
    nibabel.save(nibabel.Nifti1Image(labels, np.diag([5.0, 5, 5, 1])), path)
    made["nii"] = path.read_bytes()
    return made


def damaged(content, seed):
    """Kinds of damage: cut short, bytes flipped, a piece lost, numbers declared, other content."""
    rng = np.random.default_rng(seed)
    yield "empty", b""
    for share in (0.02, 0.3, 0.6, 0.95):
        yield f"cut at {share}", content[: int(share * len(content))]
    for count in (1, 3, 30):
        flipped = np.frombuffer(content, np.uint8).copy()
        flipped[rng.integers(0, len(content), count)] ^= rng.integers(1, 256, count).astype(np.uint8)
        yield f"{count} bytes flipped", flipped.tobytes()
    middle = len(content) // 2
    yield "a piece lost", content[:middle] + content[middle + len(content) // 7 :]
    for number in MANY:
        size = str(len(POINTS)).encode()
        yield f"promises {number}", content.replace(size, str(number).encode())
        if content[80:84] == np.uint32(len(FACES)).tobytes():
            yield f"says {number}", content[:80] + np.uint32(min(number, 2**32 - 1)).tobytes() + content[84:]
    yield "numbers that are none", re.sub(rb"0\.0[0-9]", b"nan", content)
    yield "text", b"this is not a mesh at all\n" * 20
    yield "a picture", b"\x89PNG\r\n\x1a\n" + bytes(200)
    yield "zeros", bytes(len(content))


def test_every_whole_file_is_read(tmp_path):
    for name, content in whole(tmp_path).items():
        path = tmp_path / f"again.{name}"
        path.write_bytes(content)
        surface = opened(Source(path))
        want, near = (216 * 5.0**3, 0.15) if name == "nii" else (4.8e-5, 1e-5)
        assert signed_volume(surface.points, surface.triangles) == pytest.approx(want, rel=near), name


def test_damaged_files_get_a_sentence_in_words(tmp_path):
    tried, refused = 0, []
    for seed, (name, content) in enumerate(whole(tmp_path).items()):
        for what, spoilt in damaged(content, seed):
            path = tmp_path / f"bad.{name}"
            path.write_bytes(spoilt)
            tried += 1
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    examine(path, unit=None if name == "nii" else "m")
            except StudyError as error:
                refused.append((path.name, str(error), f"{name}, {what}"))
    for file, reason, which in refused:
        assert file in reason and "\n" not in reason and not PYTHON.search(reason), f"{which}: {reason}"
    assert tried > 200 and len(refused) > tried / 2


COMMAS = b"solid x\nfacet normal 0 0 1\n outer loop\n  vertex 1.5 0.25 -3e0\n  vertex 1 2 3\n  vertex 4 5.5 6\n"
COMMAS += b" endloop\nendfacet\nendsolid x\n"


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("a.ply", b"", "(it is empty)"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 4000000000\nend_header\n", "promises 4,000,000,000 points"),
        ("a.off", b"OFF\n4000000000 12 0\n0 0 0\n", "promises 4,000,000,000 points"),
        ("a.vtu", b'<VTKFile type="UnstructuredGrid"><Piece NumberOfPoints="4000000000"', "4,000,000,000 points"),
        ("a.stl", bytes(80) + b"\xff\xff\xff\xff" + bytes(50), "a.stl is cut short: its header promises 4,294,967,295"),
        ("a.stl", b"<!DOCTYPE html><html>no such page</html>", "it is a web page: the download has failed"),
        ("a.stl", b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "a Git LFS pointer"),
        ("a.obj", b"PK\x03\x04" + bytes(90), "it is a zip archive: unpack it first"),
        ("a.vtk", b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET STRUCTURED_POINTS\n", "a.vtk"),
        ("a.vtp", b'<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="3"', "it is cut short"),
        ("a.stl", b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "it is cut short: its end is missing"),
        (
            "a.stl",
            b"ply\nformat ascii 1.0\n" + bytes(900),
            "it is not an STL file but a PLY file: give it the ending of its",
        ),
        ("a.stl", b"glTF\x02\x00\x00\x00" + b"\xf7" * 900, "it is not an STL file but a glTF file"),
        (
            "a.stl",
            b"Dear reader, this is a letter of more than eighty-four letters and no surface. " * 9,
            "it is not an STL file: it",
        ),
        ("a.stl", COMMAS.replace(b".", b","), "line 4 has decimal commas, 'vertex 1,5 0,25 -3e0': export it with"),
    ],
)
def test_the_reason_is_the_true_one(tmp_path, name, content, reason):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(StudyError) as caught:
        opened(Source(path))
    assert reason in str(caught.value)


@pytest.mark.parametrize("suffix", ["obj", "stl", "off"])
def test_surfaces_without_a_usable_triangle_are_findings(tmp_path, suffix):
    path = tmp_path / f"flat.{suffix}"
    meshio.write_points_cells(path, np.zeros((3, 3)), [("triangle", np.array([[0, 1, 2]]))])
    report = examine(path, unit="mm")
    assert "collapsed" in [finding.code for finding in report.findings]


def test_a_binary_stl_that_is_too_short_is_refused_and_a_text_is_not_taken_for_one(tmp_path):
    path = tmp_path / "half.stl"
    meshio.write_points_cells(path, POINTS, [("triangle", FACES)], file_format="stl", binary=True)
    path.write_bytes(path.read_bytes()[:2000])
    sentence = r"half.stl is cut short: its header promises 48 triangles in 2,484 bytes, but it has 2,000; copy"
    for read in (read_mesh, scan, examine):
        with pytest.raises(StudyError, match=sentence):
            read(path)
    meshio.write_points_cells(path, POINTS, [("triangle", FACES)], file_format="stl", binary=False)
    assert read_mesh(path).volume == pytest.approx(4.8e-5, rel=1e-6)


def test_large_files_are_announced(tmp_path):
    path = tmp_path / "huge.obj"
    with open(path, "wb") as file:
        file.truncate(600_000_000)  # takes no room on the disk
    assert size_warning(path) == "huge.obj has 600 MB; to read and check it can take minutes"
    os.truncate(path, 99_999_999)
    assert size_warning(path) is None
