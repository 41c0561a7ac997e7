"""The mesh doctor: every fault is found, counted and reported, with its option; sound meshes have none."""

import json
import re
from pathlib import Path

import meshio
import numpy as np
import pytest

from massspring import Material, step_limit, tetrahedral_body
from studies.base.errors import StudyError
from studies.geometry.doctor.examine import examine
from studies.geometry.doctor.findings import RULES
from studies.geometry.surface.node_count import split_edge
from tests.studies.geometry.boxes import box, split, together
from tests.studies.geometry.real import COARSE, real_surface

DOCUMENT = Path(__file__).parents[4] / "docs" / "meshes.md"
EGG = split(*box((-1, -1, -1), (1, 1, 1)), times=2)
POINTS = EGG[0] / np.linalg.norm(EGG[0], axis=1, keepdims=True) * (0.03, 0.025, 0.02)
FACES = EGG[1]


def examined(tmp_path, points, faces, suffix="vtu", **options):
    path = tmp_path / f"mesh.{suffix}"
    meshio.write_points_cells(path, points, [("triangle", np.asarray(faces, np.int32))])
    return examine(path, **options)


def ring():
    """A surface with one handle: a square ring of twelve-sided section."""
    outer, inner = box((0, 0, 0), (3, 3, 1)), box((1, 1, 0), (2, 2, 1))
    points, faces = together(outer, (inner[0], inner[1][:, ::-1]))
    flat = np.abs(np.ptp(points[faces][:, :, 2], axis=1)) < 1e-9
    sides = faces[~flat]
    lids = []
    for z in (0, 1):
        square, hole = ([k + z for k in (0, 4, 6, 2)], [8 + k + z for k in (0, 4, 6, 2)])
        for a, b, c, d in zip(square, np.roll(square, -1), np.roll(hole, -1), hole, strict=True):
            lids += [[a, b, c], [a, c, d]] if z else [[a, c, b], [a, d, c]]
    return 0.03 * points, np.vstack([sides, lids])


def broken():
    """Mesh, code, count and a piece of its sentence."""
    nan, folded, spiky = POINTS.copy(), POINTS.copy(), POINTS.copy()
    nan[3] = np.nan
    top = POINTS[:, 2].argmax()
    folded[top] += (0.02, 0, -0.003)
    a, b = FACES[0][:2]
    spiky[a] = spiky[b] + 0.02 * (spiky[a] - spiky[b])
    hinge = np.vstack([FACES, [[a, b, len(POINTS)]]])
    turned = FACES.copy()
    turned[5] = turned[5, ::-1]
    apart = FACES.copy()
    apart[0, 0] = len(POINTS)
    speck = (0.001 * box()[0] + 0.05, box()[1])
    far = POINTS - 2 * POINTS[top]
    pinch = np.vstack([FACES, np.where(top == FACES, top, FACES + len(POINTS))])
    both_ends = np.vstack([POINTS, far * [1, 1, -1] * [1, 1, -1] + 2 * (POINTS[top] - far[top])])
    return {
        "bad_points": (nan, FACES, 1, "1 points are not numbers"),
        "open": (POINTS, FACES[7:], None, "so it has no inside"),
        "disagreeing": (POINTS, turned, 3, "at 3 edges neighbouring triangles have opposite orientations"),
        "inside_out": (POINTS, FACES[:, ::-1], 1, "the surface is inverted (volume -"),
        "crowded": (np.vstack([POINTS, [[0.1, 0, 0]]]), hinge, 1, "1 edges have more than two triangles"),
        "duplicate_triangles": (POINTS, np.vstack([FACES, FACES[4:6]]), 2, "2 triangles occur twice"),
        "collapsed": (POINTS, np.vstack([FACES, [[0, 0, 1]]]), 1, "1 triangles use a point twice"),
        "unused_points": (np.vstack([POINTS, [[0, 0, 0.0]]]), FACES, 1, "1 points are not used by any triangle"),
        "duplicate_points": (np.vstack([POINTS, POINTS[FACES[0, :1]]]), apart, 1, "1 points coincide"),
        "parts": (*together((POINTS, FACES), speck), 1, "there are 2 separate parts; a body is one"),
        "self_intersections": (folded, FACES, None, "pairs of triangles cut through each other"),
        "slivers": (spiky, FACES, 1, "is a sliver (radius ratio 0.0"),
        "size": (1e3 * POINTS, FACES, 1, "the longest side is 60 m, not a plausible organ size"),
        "handles": (*ring(), 1, "the surface has 1 handles or tunnels"),
        "pinched": (both_ends, pinch, 1, "at 1 points two sheets of the surface touch"),
        "flat": (*sliver(), 2, "2 triangles have practically no area"),
    }


def sliver():
    """The egg with an edge split so near its end that two triangles have no width."""
    a, b = FACES[0][:2]
    points, faces = split_edge(POINTS, FACES, np.array([a, b]))
    points[-1] = points[a] + 1e-5 * (points[b] - points[a])
    return points, faces


@pytest.mark.parametrize("code", broken())
def test_every_fault_is_named(tmp_path, code):
    points, faces, count, piece = broken()[code]
    report = examined(tmp_path, points, faces, unit="m")
    by_code = {finding.code: finding for finding in report.findings}
    assert code in by_code, list(by_code)
    assert piece in by_code[code].sentence and "\n" not in by_code[code].sentence
    assert by_code[code].count == count or (count is None and by_code[code].count > 0)
    assert by_code[code].mend and not report.clean
    json.dumps(report.to_dict(), allow_nan=False)


def test_a_sound_surface_has_no_findings(tmp_path, livers):
    report = examined(tmp_path, POINTS, FACES)
    assert report.clean and report.findings == ()
    m = report.measures
    assert m["closed"] and m["manifold"] and m["oriented"] and m["genus"] == 0 and m["parts"] == 1
    assert m["size"] == pytest.approx([0.06, 0.05, 0.04], rel=1e-12) and m["unit"] == "m"
    # Octahedral subdivision of an ellipsoid: 15 % less than 4/3 pi abc at 98 nodes, so only the size is checked.
    assert m["volume"] == pytest.approx(4 / 3 * np.pi * 0.03 * 0.025 * 0.02, rel=0.12)
    assert examine(livers[550]).clean
    again = examined(tmp_path, POINTS, FACES, suffix="stl")  # which repeats its corners by nature
    assert again.clean and again.measures["nodes"] == len(POINTS)


def test_lumens_are_no_faults(tmp_path):
    hollow = together((POINTS, FACES), (0.7 * POINTS, FACES[:, ::-1]))
    report = examined(tmp_path, *hollow)
    assert report.clean and report.measures["lumens"] == 1 and report.measures["parts"] == 2
    two_parts = together((POINTS, FACES), (0.7 * POINTS + (0.1, 0, 0), FACES[:, ::-1]))
    codes = {finding.code for finding in examined(tmp_path, *two_parts).findings}
    assert codes == {"parts", "inside_out"}


def test_units_are_asked_about_and_taken_for_the_numbers(tmp_path):
    report = examined(tmp_path, 1e3 * POINTS, FACES)
    (finding,) = report.findings
    assert finding.code == "unit" and "longest side of 60 is an organ's in cm or mm" in finding.sentence
    assert report.measures["unit"] == "mm" and report.measures["size"][0] == pytest.approx(0.06)
    assert examined(tmp_path, 1e3 * POINTS, FACES, unit="mm").clean
    with pytest.raises(StudyError, match="unit 'inch' is not known"):
        examined(tmp_path, POINTS, FACES, unit="inch")


def test_bodies_are_examined_too(tmp_path, livers):
    body = livers[150]
    path = tmp_path / "body.vtu"
    meshio.write_points_cells(path, body.points, [("tetra", body.tetrahedra)])
    report = examine(path)
    assert report.clean and report.measures["kind"] == "tetrahedra"
    assert report.measures["volume"] == pytest.approx(body.volume, rel=1e-12)
    springs = step_limit(tetrahedral_body(body.points, body.triangles, body.tetrahedra, Material(1800.0, 1060.0)))
    assert report.measures["springs"]["how"] == "measured"
    assert report.measures["springs"]["dt_limit"] == pytest.approx(springs.undamped, rel=1e-3)
    stiff = examine(path, tissue=(7200.0, 1060.0)).measures["springs"]
    assert stiff["dt_limit"] == pytest.approx(springs.undamped / 2, rel=1e-3)  # omega ~ sqrt(mu)
    bad = body.tetrahedra.copy()
    bad[3] = bad[3, [1, 0, 2, 3]]
    flat = body.points.copy()
    inner = np.flatnonzero((body.tetrahedra >= body.surface_count).any(axis=1))[0]
    corner = body.tetrahedra[inner].max()
    others = np.setdiff1d(body.tetrahedra[inner], corner)
    flat[corner] = flat[others].mean(axis=0) + 0.01 * (flat[corner] - flat[others].mean(axis=0))
    other = np.where(np.arange(len(body.tetrahedra))[:, None] % 2, body.tetrahedra[:, [0, 2, 1, 3]], body.tetrahedra)
    meshio.write_points_cells(path, body.points, [("tetra", other)])
    report = examine(path)
    (finding,) = report.findings
    assert finding.sentence == f"{finding.count} of {len(other)} tetrahedra are numbered by the other hand"
    assert report.measures["volume"] == pytest.approx(body.volume, rel=1e-12)
    folded = body.points.copy()
    folded[body.tetrahedra[0, 3]] += 3 * (
        body.points[body.tetrahedra[0, :3]].mean(axis=0) - folded[body.tetrahedra[0, 3]]
    )
    meshio.write_points_cells(path, folded, [("tetra", body.tetrahedra)])
    assert "have zero or negative volume" in {f.code: f.sentence for f in examine(path).findings}["inverted"]
    for points, cells, code in (
        (body.points, bad, "inverted"),
        (body.points, np.vstack([body.tetrahedra, body.tetrahedra[:1]]), "duplicate_tetrahedra"),
        (flat, body.tetrahedra, "tetrahedron_slivers"),
    ):
        meshio.write_points_cells(path, points, [("tetra", cells)])
        assert code in {finding.code for finding in examine(path).findings}


@pytest.mark.parametrize("name", COARSE)
def test_real_surfaces_are_sound(name):
    report = examine(real_surface(name), unit="mm")
    assert report.clean and report.measures["genus"] == 0
    assert report.measures["springs"]["dt_limit"] > 0


def test_the_document_lists_every_key(tmp_path, livers):
    text = DOCUMENT.read_text(encoding="utf-8")
    cells = re.findall(r"^\|( `[a-z_0-9]+`[^|]*)", text, re.MULTILINE)
    named = {name for cell in cells for name in re.findall(r"`([a-z_0-9]+)`", cell)}
    codes = {code for code, *_ in RULES}
    assert codes <= named
    path = tmp_path / "body.vtu"
    meshio.write_points_cells(path, livers[150].points, [("tetra", livers[150].tetrahedra)])
    keys = set(examine(path).measures) | set(examined(tmp_path, POINTS, FACES).measures)
    assert keys <= named, keys - named
    assert named <= keys | codes, named - keys - codes
