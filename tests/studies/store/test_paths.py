"""Where results lie."""

import pytest

from studies.base.errors import StudyError
from studies.store.paths import key_hash, readable, record_files, record_path, timing_path


def test_paths_are_readable_and_differ_by_the_case(tmp_path):
    path = record_path(tmp_path, "volume_loss", "ball / free, dt=0.5·dt_c", '{"dt": 1, "m": 2}')
    assert path.parent == tmp_path / "volume_loss"
    other_order = '{"m": 2, "dt": 1}'
    assert path.name == f"ball-free-dt=0.5-dt_c-{key_hash(other_order)}.h5"
    assert record_path(tmp_path, "volume_loss", "x", '{"dt": 1}') != record_path(
        tmp_path, "volume_loss", "x", '{"dt": 2}'
    )
    assert readable("x" * 300 + "!") == "x" * 100
    assert readable("../..") == "case"


def test_a_hash_does_not_change_between_versions():
    # printf '{"dt":1}' | sha256sum
    assert key_hash('{ "dt" : 1 }') == "f8cd3b88"


@pytest.mark.parametrize("study", ["../elsewhere", "a/b", "", ".hidden"])
def test_a_study_stays_in_its_folder(tmp_path, study):
    with pytest.raises(StudyError, match="cannot name a study"):
        record_path(tmp_path, study, "x", "{}")


def test_timing_files_are_siblings_and_no_records(tmp_path):
    path = record_path(tmp_path, "volume_loss", "ball/free", '{"a": 1}')
    timing = timing_path(path, "89abcdef")
    assert timing.name == path.name.replace(".h5", ".timing.89abcdef.h5")
    path.parent.mkdir()
    for file in (path, timing, path.with_name(path.name + ".77.part"), path.with_name("volume_loss.h5")):
        file.touch()
    assert record_files(tmp_path, "volume_loss") == [path]
    with pytest.raises(StudyError, match="cannot be a machine id"):
        timing_path(path, "../x")
