import shutil

import h5py
import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.store import links
from studies.store.ledger import Ledger
from studies.store.links import link_study
from studies.store.paths import index_path, key_hash, record_path, timing_path
from studies.store.record import SCHEMA, Field, Record, Status, read_record, write_record


def store(root, name, key, status=Status.OK, message=""):
    record = Record(SCHEMA, "made up", key, name, status, message, "c0de" * 16, "01234567", {"worst": 1.25e-4})
    record.fields["volume"] = Field(np.array([1.0, 0.5, np.nan]), "m^3", "enclosed volume")
    path = record_path(root, "volume_loss", name, key)
    write_record(path, record)
    return path


def test_a_record_that_is_open_by_its_link_can_be_read(tmp_path):
    path = store(tmp_path, "ball", "{}")
    link_study(Ledger(tmp_path), "volume_loss")
    with h5py.File(index_path(tmp_path, "volume_loss")) as file:
        case = file["ball"]
        assert read_record(path).attributes == {"worst": 1.25e-4} and case["volume"].shape == (3,)


def test_the_index_opens_every_case_by_its_name_and_can_be_moved(tmp_path):
    one, two = store(tmp_path, "ball/free", '{"a": 1}'), store(tmp_path, "ball/implicit", '{"a": 2}')
    shutil.copy(one, timing_path(one, "01234567"))
    assert link_study(Ledger(tmp_path), "volume_loss") == []
    (tmp_path / "volume_loss").rename(tmp_path / "moved")
    with h5py.File(tmp_path / "moved" / "volume_loss.h5") as file:
        assert sorted(file["ball"]) == ["free", "implicit"]
        assert file["ball/free"].attrs["key"] == '{"a": 1}'
        np.testing.assert_array_equal(file["ball/implicit/volume"], [1.0, 0.5, np.nan])
        assert file["timing/01234567/ball/free"].attrs["name"] == "ball/free"
    assert two.parent == tmp_path / "volume_loss"


def test_names_that_clash_get_their_hash(tmp_path):
    names = ["ball", "ball", "ball/free", "timing", "/", "../x"]
    paths = [store(tmp_path, name, f'{{"a": {i}}}') for i, name in enumerate(names)]
    assert link_study(Ledger(tmp_path), "volume_loss") == []
    with h5py.File(index_path(tmp_path, "volume_loss")) as file:
        hashes = [key_hash(f'{{"a": {i}}}') for i in range(6)]
        assert {*file} == {
            f"ball-{hashes[0]}", f"ball-{hashes[1]}", "ball", f"timing-{hashes[3]}", paths[4].stem, "x",
        }  # fmt: skip
        assert file[f"ball-{hashes[1]}"].attrs["key"] == '{"a": 1}'


def test_two_records_of_one_name_are_both_in_the_index(tmp_path):
    for number in (1, 2):
        store(tmp_path, "ball", f'{{"a": {number}}}')
    link_study(Ledger(tmp_path), "volume_loss")
    with h5py.File(index_path(tmp_path, "volume_loss")) as file:
        assert {case.attrs["key"] for case in file.values()} == {'{"a": 1}', '{"a": 2}'}


def test_an_unreadable_case_is_reported_and_left_out(tmp_path):
    store(tmp_path, "ball/free", '{"a": 1}')
    bad = store(tmp_path, "ball/implicit", '{"a": 2}')
    bad.write_bytes(bad.read_bytes()[:900])
    problems = link_study(Ledger(tmp_path), "volume_loss")
    assert len(problems) == 1
    assert bad.name in problems[0]
    with h5py.File(index_path(tmp_path, "volume_loss")) as file:
        assert list(file["ball"]) == ["free"]


def test_an_index_is_no_record(tmp_path):
    store(tmp_path, "ball/free", '{"a": 1}')
    link_study(Ledger(tmp_path), "volume_loss")
    with pytest.raises(StudyError, match="is the index of a study"):
        read_record(index_path(tmp_path, "volume_loss"))


def test_an_index_that_says_the_same_is_left_as_it_is(tmp_path, monkeypatch):
    """`run` can read results in a folder that it cannot write to."""
    store(tmp_path, "ball/free", '{"a": 1}')
    link_study(Ledger(tmp_path), "volume_loss")
    before = index_path(tmp_path, "volume_loss").stat().st_mtime_ns
    monkeypatch.setattr(links, "write_whole", lambda *_: pytest.fail("nothing has changed"))
    link_study(Ledger(tmp_path), "volume_loss")
    assert index_path(tmp_path, "volume_loss").stat().st_mtime_ns == before
