"""`organbench view`: which cases words name, what is listed, what is missing, and bad input."""

import shutil
from dataclasses import replace

import h5py
import pytest

from massspring import Free
from studies.scene.library import BALL_RINGING
from studies.store.record import Status, read_record, write_record
from tests.studies.made_up_run import SCENE
from tests.studies.report.view.made import stored_case, stored_reference


@pytest.fixture
def root(tmp_path, monkeypatch):
    """A reference, two cases of it, one of which a second study has too, and one that did not start. A file
    without a name lands next to it."""
    monkeypatch.chdir(tmp_path)
    root = tmp_path / "results"
    stored_reference(root)
    kept = stored_case(root)
    stored_case(root, "another")
    stored_case(root, method=Free(), status=Status.INVERTED)
    record = read_record(kept)
    failed = replace(record, status=Status.FAILED, fields={}, name="failed", key='{"scene": {"name": "ball_clamped"}}')
    write_record(kept.with_name("failed-00000000.h5"), failed)
    return root


def names_in(path) -> list[str]:
    with h5py.File(path) as file:
        return [name.decode() for name in file["VTKHDF/FieldData/case_name"]]


def stem(root, word) -> str:
    (path,) = (root / "made").glob(f"*{word}*.h5")
    return path.stem


def test_a_scene_is_all_of_its_cases_beside_the_reference(root, tmp_path, organbench):
    path = tmp_path / "all.vtkhdf"
    code, out, err = organbench("view", "ball_clamped", "-o", path, "--results", root)
    assert (code, err) == (0, "")
    reference, *cases = names_in(path)
    assert reference.startswith("reference ball_clamped-")
    assert cases == [f"{stem(root, 'free')} (inverted)", stem(root, "implicit_volume")]
    first, *lines = out.splitlines()
    assert first.startswith(f"{path}: 3 bodies at 2 4 s, ")
    assert [line.split(maxsplit=1)[1] for line in lines] == names_in(path)


def test_cases_are_named_by_name_file_or_path_once_each(root, organbench):
    by_file, by_path = stem(root, "free"), root / "made" / f"{stem(root, 'free')}.h5"
    code, out, err = organbench("view", by_file.rsplit("-", 1)[0], by_file, by_path, "--results", root)
    assert (code, err) == (0, "") and out.startswith("ball_clamped.vtkhdf: 2 bodies")
    assert names_in("ball_clamped.vtkhdf")[1:] == [f"{by_file} (inverted)"]


def test_alone_it_lists_what_can_be_viewed(root, organbench):
    code, out, err = organbench("view", "--results", root)
    assert (code, err) == (0, "")
    head, *cases = out.splitlines()
    assert head.startswith("ball_clamped: 2 cases, reference ball_clamped-")
    assert [case.strip() for case in cases] == [f"{stem(root, 'free')} (inverted)", stem(root, "implicit_volume")]


def test_a_warning_names_what_is_missing_and_the_rest_is_shown(root, tmp_path, organbench):
    for file in (root / "reference").iterdir():
        file.unlink()
    stored_reference(root, status=Status.NOT_CONVERGED)
    (root / "made" / f"{stem(root, 'free')}.h5").write_bytes(b"cut off")
    code, out, err = organbench("view", "ball_clamped", "-o", tmp_path / "a.vtkhdf", "--results", root)
    damaged, missing = err.splitlines()
    assert code == 0 and ": 1 body at 2 4 s, " in out
    assert "is not an HDF5 file" in damaged and "the reference of 'ball_clamped' is not stored" in missing
    with h5py.File(tmp_path / "a.vtkhdf") as file:
        assert "error" not in file["VTKHDF/PointData"]


BAD_WORDS = {
    "unknown scene or stored case 'bal_clamped'; did you mean 'ball_clamped'": ["bal_clamped"],
    "nothing of 'liver_press' is stored in": ["liver_press"],
    "there is no results file no/such/file.h5": ["no/such/file.h5"],
    "choose a name that ends in .vtkhdf": ["ball_clamped", "-o", "a.vtu"],
    "there is no folder": ["--results", "nowhere"],
    "nothing to view is stored in": ["--results", "."],
}


@pytest.mark.parametrize("sentence", BAD_WORDS)
def test_bad_words_are_one_sentence(root, refused, sentence):
    assert sentence in refused("view", "--results", root, *BAD_WORDS[sentence])


def test_what_does_not_belong_in_one_file_is_refused(root, refused):
    stored_case(root, "ringing", replace(BALL_RINGING, checkpoints=SCENE.checkpoints, duration=4.0))
    assert "are two scenes; view each in a file" in refused("view", "ball_clamped", "ball_ringing", "--results", root)
    stored_case(root, "changed", replace(SCENE, checkpoints=(1.0, 4.0)))
    assert "have different checkpoints" in refused("view", "ball_clamped", "--results", root)


def test_files_of_an_earlier_version_are_one_warning(root, organbench):
    with h5py.File(root / "made" / "old-00000001.h5", "w") as file:
        file.attrs["schema"] = 1
    shutil.copy(root / "made" / "old-00000001.h5", root / "made" / "old-00000002.h5")
    code, out, err = organbench("view", "--results", root)
    assert code == 0 and out.startswith("ball_clamped: 2 cases, ")
    assert len(err.splitlines()) == 1 and "(and 1 more files)" in err
