"""`organbench mesh --check` tries its advice: the command makes a clean body, or the output lists what was tried."""

import json
import shlex

import meshio
import nibabel
import numpy as np
import pytest

from studies.geometry.api import advice
from studies.geometry.doctor.examine import examine
from studies.geometry.files.units import Source
from tests.studies.geometry.boxes import box, split, together

EGG = split(*box((-1, -1, -1), (1, 1, 1)), times=3)
POINTS = EGG[0] / np.linalg.norm(EGG[0], axis=1, keepdims=True) * (30, 25, 20)
FACES = EGG[1]
TRIED = "tested; this gives a clean body of 550 surface nodes:"


def stored(path, points, faces):
    meshio.write_points_cells(path, points, [("triangle", np.asarray(faces, np.int32))])
    return path


def damaged():
    """By fault: points [mm], triangles, and the options that must stand in the command."""
    turned, spiky, folded = FACES.copy(), POINTS.copy(), POINTS.copy()
    turned[:40] = turned[:40, ::-1]
    spiky[FACES[0, 0]] = spiky[FACES[0, 1]] + 0.02 * (spiky[FACES[0, 0]] - spiky[FACES[0, 1]])
    folded[POINTS[:, 2].argmax()] += (18, 0, -3)
    fin = np.vstack([FACES, [[*FACES[0, :2], len(POINTS)]]])
    speck = box((60, 60, 60), (62, 62, 62))
    shell = together((POINTS, FACES), (0.98 * POINTS, FACES[:, ::-1]))
    cup = FACES[POINTS[FACES].mean(axis=1)[:, 2] < 12]
    return {
        "open, turned, two parts": (*together((POINTS, turned[9:]), speck), ("--close-holes",)),
        "a sliver": (spiky, FACES, ()),
        "crossing itself": (folded, FACES, ()),
        "a fin": (np.vstack([POINTS, [[0, 0, 40]]]), fin, ()),
        "a cup": (POINTS, cup, ("--close-holes",)),
        "a capsule": (*shell, ()),
    }


QUICK = "open, turned, two parts"


@pytest.mark.parametrize(
    "fault", [pytest.param(name, marks=() if name == QUICK else pytest.mark.campaign) for name in damaged()]
)
def test_the_command_that_is_printed_works(organbench, tmp_path, monkeypatch, fault):
    points, faces, options = damaged()[fault]
    monkeypatch.chdir(tmp_path)
    stored(tmp_path / "my scan.ply", points, faces)
    code, out, _ = organbench("mesh", "--check", "my scan.ply", "--unit", "mm")
    assert code == 1 and TRIED in out
    words = shlex.split(out.splitlines()[-1])
    assert words[:4] == ["organbench", "mesh", "--from", "my scan.ply"] and set(options) <= set(words)
    advised = [line for line in out.splitlines() if line.startswith("   -> ")]
    assert advised and not any(line.startswith("   -> try") for line in advised)
    assert organbench(*words[1:])[0] == 0
    code, out, _ = organbench("mesh", "--check", "my scan_body.vtu")
    assert code == 0, out


def test_advice_that_does_not_work_is_not_printed(organbench, tmp_path):
    """No option makes a body of an open triangle, or of a bowl with a double wall."""
    path = stored(tmp_path / "one.ply", 100 * np.eye(3), [[0, 1, 2]])
    code, out, _ = organbench("mesh", "--check", path, "--unit", "mm")
    assert code == 1 and TRIED not in out and "-> try" not in out and "FILE" not in out
    assert "tried: --nodes 550 --close-holes; --nodes 550 --smooth 3 --close-holes; --nodes 550 --solid 5; none" in out
    assert "the widest is 141 mm wide, at (33.33, 33.33, 33.33) mm" in out
    assert json.loads(organbench("mesh", "--check", path, "--unit", "mm", "--json")[1])["command"] is None


def test_what_no_option_repairs_and_what_is_large_is_not_tried(tmp_path, monkeypatch):
    calls = []
    monkeypatch.setattr(advice, "scan", lambda *words, **how: calls.append(how))
    large = Source(stored(tmp_path / "large.ply", POINTS, FACES[3:]), "mm")
    monkeypatch.setattr(advice, "MOST", 100)
    checked = advice.with_command(large, examine(large))
    assert checked.command is None
    assert checked.findings[0].mend.startswith("try organbench mesh --from FILE --close-holes")
    nan = POINTS.copy()
    nan[0] = np.nan
    bad = Source(stored(tmp_path / "nan.ply", nan, FACES), "mm")
    assert advice.with_command(bad, examine(bad)).command is None
    sound = Source(stored(tmp_path / "sound.ply", POINTS, FACES))
    assert advice.with_command(sound, examine(sound)) == examine(sound)  # its unit alone is a question
    assert not calls


def test_the_command_takes_the_file_as_it_was_taken(tmp_path):
    path = stored(tmp_path / "egg.ply", POINTS, FACES)
    for source, words in (
        (Source(path, "cm", 0.1), ["--unit", "cm", "--scale", "0.1"]),
        (Source(path, longest_side=0.06, part="1"), ["--longest-side", "0.06m", "--part", "1"]),
    ):
        parts = shlex.split(advice.command(source, {"smooth": 0.003}))
        assert parts[4 : 4 + len(words)] == words and parts[4 + len(words) :][:4] == ["--nodes", "550", "--smooth", "3"]


def test_what_is_left_is_named(monkeypatch, tmp_path):
    """Of a body that comes out with a finding: the options that make it, and the finding."""
    source = Source(stored(tmp_path / "open.ply", POINTS, FACES[3:]), "mm")
    ring = examine(source)
    monkeypatch.setattr(advice, "examined", lambda source, how: None if "solid" in how else ring)
    (finding,) = advice.with_command(source, ring).findings
    assert finding.mend.endswith("; --nodes 550 --close-holes makes a body, in which this is left: open")


def test_a_file_of_no_organs_size_is_not_meshed(monkeypatch, tmp_path):
    """Its unit is missing: 2 m is no organ's length in m, cm or mm."""
    monkeypatch.setattr(advice, "scan", lambda *words, **how: pytest.fail("meshed"))
    source = Source(stored(tmp_path / "large.ply", POINTS / 30.5, FACES[3:]))
    findings = advice.with_command(source, examine(source)).findings
    assert "an organ's in no unit we know" in findings[0].sentence and findings[1].mend.startswith("try ")


def test_what_is_no_organ_is_a_finding_and_a_refusal(organbench, tmp_path, monkeypatch):
    """0.5 mL, and a body a million metres from the origin: by check as findings, by mesh and place as a sentence."""
    monkeypatch.chdir(tmp_path)
    small = (0.5e3 / (4 / 3 * np.pi * 30 * 25 * 20)) ** (1 / 3)
    stored("small_liver.ply", small * POINTS, FACES)
    meshio.write_points_cells("far_liver.vtu", POINTS + np.array([1e9, 0, 0]), [("triangle", FACES)])
    for name, message in (
        ("small_liver.ply", "encloses 0.49 mL, and no organ is smaller than 1 mL"),
        ("far_liver.vtu", "it lies 1e+06 m from the origin of its coordinates"),
    ):
        code, out, _ = organbench("mesh", "--check", name, "--unit", "mm")
        assert code == 1 and message in out and TRIED not in out
        for words in (("mesh", "--from", name, "--nodes", 200), ("mesh", "--from", name), ("place", name)):
            code, _, err = organbench(*words, "--unit", "mm")
            assert code == 2 and message in err, words
    assert sorted(path.name for path in tmp_path.iterdir()) == ["far_liver.vtu", "small_liver.ply"]


def test_grey_values_are_refused_by_all_three(organbench, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    grey = np.random.default_rng(0).integers(0, 239, (30, 30, 30)).astype(np.int16)
    nibabel.save(nibabel.Nifti1Image(grey, np.eye(4)), "liver_ct.nii.gz")
    for words in (("mesh", "--check"), ("mesh", "--nodes", 200, "--from"), ("place",)):
        code, out, err = organbench(*words, "liver_ct.nii.gz", "--part", "204")
        assert code == 2 and not out and "grey values" in err and "not a mask: segment it first" in err


@pytest.mark.campaign
def test_a_mask_has_a_plain_file_name_and_is_in_millimetres(organbench, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    axes = np.meshgrid(*[np.arange(-25.0, 26.0)] * 3, indexing="ij")
    ball = (sum(axis**2 for axis in axes) < 20**2).astype(np.uint8)
    ball[1:4, 1:4, 1:4] = 1
    nibabel.save(nibabel.Nifti1Image(ball, np.eye(4)), "spleen_mask.nii.gz")
    code, out, err = organbench("mesh", "--check", "spleen_mask.nii.gz")
    assert code == 1 and out.rstrip().endswith("-o spleen_mask_body.vtu")
    assert err.count("its header does not say the unit; assuming millimetres") == 1
