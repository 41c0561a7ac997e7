"""Surfaces in the formats that people have, each with the volume and the parts that it was written with."""

import hashlib
import json

import meshio
import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import read_mesh, scan
from studies.geometry.doctor.examine import examine
from studies.geometry.files.opening import opened
from studies.geometry.files.units import Source
from studies.geometry.mesh.organ_mesh import signed_volume
from tests.studies.geometry.boxes import box, split
from tests.studies.geometry.files import writers

POINTS, FACES = split(*box((-1, -1, -1), (1, 1, 1)), times=2)
POINTS = POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True) * (30, 25, 20)
VOLUME = signed_volume(POINTS, FACES)
SMALL = 0.4 * POINTS


def written(path, content):
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("modern", [False, True])
def test_legacy_vtk_surfaces_are_read(tmp_path, binary, modern):
    path = written(tmp_path / "egg.vtk", writers.legacy_vtk(POINTS, FACES, binary, modern))
    mesh = read_mesh(path, unit="mm")
    assert mesh.volume == pytest.approx(1e-9 * VOLUME, rel=1e-6) and len(mesh.triangles) == len(FACES)


def test_polygons_and_strips_become_triangles_that_look_the_same_way(tmp_path):
    corners, _ = box(high=(60, 50, 40))
    quads = "4 0 1 3 2\n4 4 6 7 5\n4 0 4 5 1\n4 2 3 7 6\n"
    # The last two sides as one strip of four corners each: 0 2 4 6 looks down the other way, so 2 0 6 4.
    text = (
        "# vtk DataFile Version 2.0\nbox\nASCII\nDATASET POLYDATA\nPOINTS 8 double\n"
        + "\n".join(" ".join(map(str, p)) for p in corners)
        + f"\nPOLYGONS 4 20\n{quads}TRIANGLE_STRIPS 2 10\n4 0 2 4 6\n4 1 5 3 7\n"
    )
    mesh = read_mesh(written(tmp_path / "box.vtk", text.encode()), unit="mm")
    assert mesh.volume == pytest.approx(60 * 50 * 40e-9, rel=1e-12) and len(mesh.triangles) == 12


@pytest.mark.parametrize("mode", ["text", "packed", "raw"])
def test_vtp_surfaces_are_read_with_their_patches(tmp_path, mode):
    held = {"patch_top": (POINTS[:, 2] > 10).astype(float)}
    path = written(tmp_path / "egg.vtp", writers.vtp(POINTS, FACES, mode, held))
    mesh = read_mesh(path, unit="mm")
    assert mesh.volume == pytest.approx(1e-9 * VOLUME, rel=1e-12)
    assert (np.sort(mesh.patches["top"]) == np.flatnonzero(mesh.points[:, 2] > 0.010)).all()


def test_gltf_parts_are_listed_and_chosen_where_the_file_puts_them(tmp_path):
    parts = [("capsule", SMALL, FACES, (100, 0, 0)), ("tissue", POINTS, FACES, (0, 7, 0))]
    path = written(tmp_path / "organ.glb", writers.glb(parts))
    assert opened(Source(path)).names == ("capsule", "tissue")
    for part, scale, middle in (("tissue", 1.0, (0, 7, 0)), ("1", 0.4, (100, 0, 0)), ("Capsule", 0.4, (100, 0, 0))):
        mesh = read_mesh(Source(path, "mm", part=part))
        assert mesh.volume == pytest.approx(1e-9 * scale**3 * VOLUME, rel=1e-5)
        np.testing.assert_allclose(1e3 * mesh.points.mean(axis=0), middle, atol=1e-4)
    rows = examine(Source(path, "mm")).measures["part_list"]
    assert [(row["number"], row["name"], row["cells"]) for row in rows] == [
        (1, "capsule", len(FACES)),
        (2, "tissue", len(FACES)),
    ]
    assert max(rows[1]["size"]) == pytest.approx(0.060, rel=1e-6)
    with pytest.raises(StudyError, match=r"organ\.glb has the parts capsule, tissue; there is no 'vessel' among them"):
        read_mesh(Source(path, "mm", part="vessel"))
    # Metres are glTF's unit: an organ of 60 m is refused and not taken for one of 60 mm.
    with pytest.raises(StudyError, match="the longest side is 142 m; no organ is larger than 5 m"):
        scan(path)


def test_objects_and_relative_numbers_of_obj(tmp_path):
    content = writers.obj([("one", SMALL + 90, FACES), ("two", POINTS, FACES)])
    path = written(tmp_path / "two.obj", content)
    assert opened(Source(path)).names == ("one", "two")
    for part, factor in (("one", 0.4), ("2", 1.0)):
        assert read_mesh(Source(path, "mm", part=part)).volume == pytest.approx(1e-9 * factor**3 * VOLUME, rel=1e-6)


def test_parts_without_names_are_numbered_by_size(tmp_path):
    shifted = [np.vstack([SMALL + 90, POINTS]), np.vstack([FACES, FACES + len(POINTS)])]
    path = written(tmp_path / "two.vtk", writers.legacy_vtk(*shifted, binary=True))
    for part, factor in (("1", 1.0), ("2", 0.4)):
        mesh = scan(Source(path, "mm", part=part), fill=False)
        assert mesh.volume == pytest.approx(1e-9 * factor**3 * VOLUME, rel=1e-6)
    with pytest.raises(StudyError, match="has 2 parts, numbered from 1 by their size; there is no '3'"):
        scan(Source(path, "mm", part="3"))
    with pytest.warns(UserWarning, match="1 of 2 separate parts are left out"):
        assert scan(path, unit="mm", fill=False).volume == pytest.approx(1e-9 * VOLUME, rel=1e-6)


@pytest.mark.parametrize(
    "options",
    [{"unit": "mm", "scale": 2.0}, {"unit": "in", "scale": 2 / 25.4}, {"scale": 0.002}, {"longest_side": 0.120}],
    ids=str,
)
def test_any_scale_leads_to_the_same_body(tmp_path, options):
    path = written(tmp_path / "egg.vtk", writers.legacy_vtk(POINTS, FACES, binary=True))
    mesh = scan(Source(path, **options), fill=False)
    assert mesh.volume == pytest.approx(8e-9 * VOLUME, rel=1e-6)
    assert examine(Source(path, **options)).measures["volume"] == pytest.approx(8e-9 * VOLUME, rel=1e-6)


REFUSED = {
    "a scale of 0 is asked for": {"scale": 0.0},
    "a scale of nan": {"scale": float("nan")},
    "an organ has 1 mm to 5 m": {"longest_side": 12.0},
    "give the longest side, or a unit and a scale, but not both": {"longest_side": 0.1, "unit": "mm"},
    "use one of m, cm, mm, um, in": {"unit": "furlong"},
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_scales_that_are_none_are_refused(tmp_path, sentence):
    with pytest.raises(StudyError, match=sentence):
        Source(tmp_path / "egg.vtk", **REFUSED[sentence])


@pytest.mark.parametrize("factor", [1e300, 80e-9 / 0.06])
def test_sizes_beyond_all_organs_are_refused_at_once(tmp_path, factor):
    path = tmp_path / "odd.off"
    meshio.write_points_cells(path, 1e-3 * factor * POINTS, [("triangle", FACES)])
    limit = "smaller than 1 mm" if factor < 1 else "larger than 5 m"
    with pytest.raises(StudyError, match=f"the longest side is .* m; no organ is {limit}"):
        scan(path, 200, unit="m")
    for read in (examine, read_mesh) if factor > 1 else ():
        with pytest.raises(StudyError, match="no organ is larger than 5 m"):
            read(path, unit="m")
    assert factor > 1 or "size" in [finding.code for finding in examine(path, unit="m").findings]


def test_what_a_gltf_names_belongs_to_it(tmp_path):
    """Results belong to the numbers, which lie in another file."""
    buffers = [{"uri": "its%20data.bin", "byteLength": 3}, {"uri": "data:;base64,AAAA"}, {"byteLength": 3}]
    path = written(tmp_path / "a.gltf", json.dumps({"buffers": buffers}).encode())
    hashes = set()
    for content in (None, b"abc", b"abd"):
        if content is not None:
            (tmp_path / "its data.bin").write_bytes(content)
        hashes.add(Source(path).sha256)
    assert len(hashes) == 3
    written(path, b"[1]")
    assert Source(path).sha256 == hashlib.sha256(b"[1]").hexdigest()
