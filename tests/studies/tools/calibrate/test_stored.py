"""A calibration is read back from its file unchanged, and any other file is refused."""

import json
from dataclasses import replace

import pytest

import studies
from studies.base.errors import DamagedFile, OtherVersion, StudyError
from studies.runs.case import BodyRecipe, Case
from studies.scene.library import LIVER_PROBE
from studies.tools.calibrate.stored import calibrated, calibration_path, read_calibration, write_calibration
from tests.studies.tools.calibrate.made_up_errors import made_up


@pytest.fixture
def path(tmp_path):
    return write_calibration(tmp_path, made_up())


def test_it_comes_back_as_it_was(path, tmp_path):
    assert path == tmp_path / "calibration" / "liver-surface-300.json" == calibration_path(tmp_path, made_up())
    assert read_calibration(path) == made_up() and read_calibration(str(path)).trials[0].fitted == ("liver_press",)
    assert path.stat().st_size < 10_000


def test_a_recipe_is_ready_for_a_case(path):
    assert studies.calibrated is calibrated
    assert Case(LIVER_PROBE, calibrated(path)).body == made_up().recipe


def test_files_of_other_bodies_do_not_meet():
    bodies = [BodyRecipe(), BodyRecipe(nodes=300), BodyRecipe(volumes="whole"), BodyRecipe(law="uniform"),
              BodyRecipe("surface")]  # fmt: skip
    assert len({made_up(start=body).name for body in bodies}) == len(bodies)


def test_a_file_tells_where_it_comes_from(path):
    whole = json.loads(path.read_text())
    data = whole["calibration"]
    assert data["fingerprint"] == "0badcafe" and data["date"] == "2026-11-22" and "python" in data["versions"]
    assert data["trials"][0]["errors"][1]["force"] == {"before": -33.2, "after": None, "uncertainty": 1.0}


def rewritten(path, change):
    whole = json.loads(path.read_text())
    change(whole)
    path.write_text(json.dumps(whole))


@pytest.mark.parametrize(
    ("change", "kind", "message"),
    [
        (lambda whole: whole["calibration"]["recipe"].update(stiffness=2.0), DamagedFile, "was changed after"),
        (lambda whole: whole["calibration"].update(verdict="holds!"), DamagedFile, "was changed after"),
        (lambda whole: whole.pop("digest"), DamagedFile, "was changed after"),
        (lambda whole: whole.update(schema=99), OtherVersion, "another version"),
        (lambda whole: whole.update(kind="something"), StudyError, "is JSON, but not a calibration"),
        (lambda whole: whole.update(calibration=[1]), StudyError, "is JSON, but not a calibration"),
    ],
)
def test_a_changed_file_is_one_sentence(path, change, kind, message):
    rewritten(path, change)
    with pytest.raises(kind, match=message):
        calibrated(path)


@pytest.mark.parametrize(
    "change",
    [
        lambda data: data["recipe"].update(colour="red"),
        lambda data: data["recipe"].update(law="glue"),
        lambda data: data["recipe"].update(nodes="many"),
        lambda data: data.pop("trials"),
        lambda data: data["trials"][0].update(more=1),
    ],
)
def test_settings_that_this_version_does_not_have_are_one_sentence(path, change, monkeypatch):
    """As a later version would have written them, its digest right."""
    rewritten(path, lambda whole: change(whole["calibration"]))
    digest = json.loads(path.read_text())["digest"]
    monkeypatch.setattr("studies.tools.calibrate.stored._digest", lambda data: digest)
    with pytest.raises(OtherVersion, match="this version"):
        calibrated(path)


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[1, 2]", b"null", b"\xff\xfe\x00", b'{"kind": "run"}', b"\x89HDF\r\n"]
)
def test_another_file_is_one_sentence(tmp_path, content):
    file = tmp_path / "file.json"
    file.write_bytes(content)
    with pytest.raises(StudyError, match="not a calibration") as refused:
        calibrated(file)
    assert "\n" not in str(refused.value)


def test_a_cut_file_is_one_sentence(path):
    whole = path.read_bytes()
    for length in (len(whole) // 2, len(whole) - 5):
        path.write_bytes(whole[:length])
        with pytest.raises(DamagedFile, match="damaged"):
            calibrated(path)


def test_no_file_and_a_folder(tmp_path):
    with pytest.raises(StudyError, match="there is no calibration"):
        calibrated(tmp_path / "none.json")
    with pytest.raises(StudyError, match="cannot be read"):
        calibrated(tmp_path)


def test_what_was_not_chosen_is_not_lost(tmp_path):
    calibration = replace(made_up(), recipe=BodyRecipe(nodes=301, stiffness=1.25, volumes="whole", law="uniform"))
    assert calibrated(write_calibration(tmp_path, calibration)) == calibration.recipe
