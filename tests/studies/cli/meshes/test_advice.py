"""What `organbench check` advises has been tried: its command makes a clean body; else the advice begins with "try"."""

import json
import shlex

import meshio
import numpy as np
import pytest

from studies.geometry.api import advice
from studies.geometry.doctor.examine import examine
from studies.geometry.files.units import Source
from tests.geometry.boxes import box, split, together
from tests.geometry.real import real_surface

EGG = split(*box((-1, -1, -1), (1, 1, 1)), times=3)
POINTS = EGG[0] / np.linalg.norm(EGG[0], axis=1, keepdims=True) * (30, 25, 20)
FACES = EGG[1]
TRIED = "tried, and a clean body of 550 surface nodes came out:"


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


@pytest.mark.parametrize("fault", [QUICK, *(pytest.param(f, marks=pytest.mark.slow) for f in damaged() if f != QUICK)])
def test_the_command_that_is_printed_works(organbench, tmp_path, monkeypatch, fault):
    points, faces, options = damaged()[fault]
    monkeypatch.chdir(tmp_path)
    stored(tmp_path / "my scan.ply", points, faces)
    code, out, _ = organbench("check", "my scan.ply", "--unit", "mm")
    assert code == 1 and TRIED in out
    words = shlex.split(out.splitlines()[-1])
    assert words[:4] == ["organbench", "mesh", "--from", "my scan.ply"] and set(options) <= set(words)
    advised = [line for line in out.splitlines() if line.startswith("   -> ")]
    assert advised and not any(line.startswith("   -> try") for line in advised)
    assert organbench(*words[1:])[0] == 0
    code, out, _ = organbench("check", "my scan_body.vtu")
    assert code == 0, out


def test_advice_that_does_not_work_is_a_try(organbench, tmp_path):
    path = stored(tmp_path / "one.ply", 100 * np.eye(3), [[0, 1, 2]])
    code, out, _ = organbench("check", path, "--unit", "mm")
    assert code == 1 and TRIED not in out
    assert "   -> try organbench mesh --from FILE --close-holes" in out
    assert json.loads(organbench("check", path, "--unit", "mm", "--json")[1])["command"] is None


def test_what_no_option_mends_and_what_is_large_is_not_tried(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(advice, "scan", lambda *words, **how: asked.append(how))
    large = Source(stored(tmp_path / "large.ply", POINTS, FACES[3:]), "mm")
    monkeypatch.setattr(advice, "MOST", 100)
    found = advice.tried(large, examine(large))
    assert found.command is None and found.findings[0].mend.startswith("try organbench mesh --from FILE --close-holes")
    nan = POINTS.copy()
    nan[0] = np.nan
    bad = Source(stored(tmp_path / "nan.ply", nan, FACES), "mm")
    assert advice.tried(bad, examine(bad)).command is None
    sound = Source(stored(tmp_path / "sound.ply", POINTS, FACES))
    assert advice.tried(sound, examine(sound)) == examine(sound)  # its unit alone is a question
    assert not asked


def test_the_command_takes_the_file_as_it_was_taken(tmp_path):
    path = stored(tmp_path / "egg.ply", POINTS, FACES)
    for source, words in (
        (Source(path, "cm", 0.1), ["--unit", "cm", "--scale", "0.1"]),
        (Source(path, longest_side=0.06, part="1"), ["--longest-side", "0.06m", "--part", "1"]),
    ):
        told = shlex.split(advice.command(source, {"smooth": 0.003}))
        assert told[4 : 4 + len(words)] == words and told[4 + len(words) :][:4] == ["--nodes", "550", "--smooth", "3"]


@pytest.mark.slow
def test_a_real_organ_with_a_hole_and_turned_triangles(organbench, tmp_path, monkeypatch):
    raw = meshio.read(real_surface("spleen_hra_550"))
    faces = raw.cells_dict["triangle"].copy()
    faces[:200] = faces[:200, ::-1]
    monkeypatch.chdir(tmp_path)
    stored(tmp_path / "spleen.ply", raw.points, faces[5:])
    code, out, _ = organbench("check", "spleen.ply")
    assert code == 1 and TRIED in out
    assert organbench(*shlex.split(out.splitlines()[-1])[1:])[0] == 0
