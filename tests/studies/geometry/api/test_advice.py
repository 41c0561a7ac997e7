"""The advice of a check is tried before it is printed; what cannot be tried says so."""

import shlex

import meshio
import numpy as np
import pytest

from studies.geometry.api import advice
from studies.geometry.doctor.examine import examine
from studies.geometry.files.units import Source
from tests.studies.geometry.boxes import box, split

EGG = split(*box((-1, -1, -1), (1, 1, 1)), times=3)
POINTS = EGG[0] / np.linalg.norm(EGG[0], axis=1, keepdims=True) * (30, 25, 20)
FACES = EGG[1]


def stored(path, points, faces):
    meshio.write_points_cells(path, points, [("triangle", np.asarray(faces, np.int32))])
    return path


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


@pytest.mark.parametrize(("size", "filled"), [(0.1, True), (1e-3, False)])
def test_no_opening_is_tried_that_is_a_large_part_of_the_body(size, filled):
    """Filling a sheet of 1 mm with openings of 5 mm took minutes and 7 GB."""
    assert any("solid" in how for how in advice.ways({"open"}, size)) == filled
