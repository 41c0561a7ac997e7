"""Files that were cut off, changed or written by others: told, named, never read as results."""

import h5py
import numpy as np
import pytest

from studies.base.errors import DamagedFile, StudyError
from studies.store import opening
from studies.store.checksums import Seal, seal_of
from studies.store.entry import DAMAGED, why_stale
from studies.store.record import SCHEMA, peek, read_record, write_record
from tests.studies import made_up_run
from tests.studies.store.test_store import KEY, assert_same, record


@pytest.fixture
def trusted(monkeypatch):
    """Files that were changed through the library can be read by it: no other process need try first."""
    monkeypatch.setattr(opening, "_comes_to_an_end", lambda path: True)


def test_a_cut_off_file_is_one_sentence_wherever_it_was_cut(tmp_path):
    path = tmp_path / "a.h5"
    write_record(path, record())
    whole = path.read_bytes()
    for size in {*range(0, 200, 7), *range(200, len(whole), 97), len(whole) - 1}:
        path.write_bytes(whole[:size])
        with pytest.raises(StudyError, match="cut off") as problem:
            read_record(path)
        assert "\n" not in str(problem.value)
        assert why_stale(path, KEY, "f" * 64) == DAMAGED


def test_foreign_files_are_one_sentence(tmp_path):
    (tmp_path / "text.h5").write_text("hello")
    with pytest.raises(StudyError, match="is not an HDF5 file"):
        read_record(tmp_path / "text.h5")
    with h5py.File(tmp_path / "theirs.h5", "w") as file:
        file["x"] = 1.0
    with pytest.raises(StudyError, match="is an HDF5 file of another program"):
        peek(tmp_path / "theirs.h5")
    with pytest.raises(StudyError, match="there is no results file"):
        peek(tmp_path / "missing.h5")
    with pytest.raises(StudyError, match="there is no results file"):
        peek(tmp_path)


@pytest.mark.parametrize("schema", [0, SCHEMA + 1, "old"])
def test_another_schema_is_refused(tmp_path, trusted, schema):
    path = tmp_path / "a.h5"
    write_record(path, record())
    with h5py.File(path, "r+") as file:
        file.attrs["schema"] = schema
    with pytest.raises(StudyError, match=f"has results schema {schema}, this version reads {SCHEMA}"):
        read_record(path)


def spoil_text(file):
    del file["volume"]
    file["volume"] = "none"
    file["volume"].attrs.update({"unit": "m^3", "description": "volume"})


def scale_last(file):
    file["volume"][-1, 0] *= 1.5


def empty(file):
    del file["tetrahedra"]
    file.create_dataset("tetrahedra", data=np.zeros((0, 4), int)).attrs.update({"unit": "1", "description": "cells"})


def dangle(file):
    del file["volume"]
    file["volume"] = h5py.SoftLink("/nowhere")


def leave(file):
    del file["volume"]
    file["volume"] = h5py.ExternalLink("nowhere.h5", "/volume")


SPOILT = {
    "a value": (scale_last, "'volume' has changed since it was written"),
    "no field": (lambda file: file.__delitem__("volume"), "lacks 'volume'"),
    "soft link": (dangle, "lacks 'volume'"),
    "external link": (leave, "lacks 'volume'"),
    "text": (spoil_text, "'volume' has changed"),
    "empty": (empty, "'tetrahedra' has changed"),
    "a group": (lambda file: (file.__delitem__("rest"), file.create_group("rest")), "lacks 'rest'"),
    "no unit": (lambda file: file["t"].attrs.__delitem__("unit"), "'t' has lost its unit"),
    "another unit": (lambda file: file["t"].attrs.__setitem__("unit", "ms"), "'t' has changed"),
    "an attribute": (lambda file: file.attrs.__setitem__("dt", 0.06), "the attribute 'dt' has changed"),
    "no attribute": (lambda file: file.attrs.__delitem__("key"), "lacks the attribute 'key'"),
    "an odd status": (lambda file: file.attrs.__setitem__("status", "splendid"), "the attribute 'status' has changed"),
    "a numeric name": (lambda file: file.attrs.__setitem__("name", 3), "the attribute 'name' has changed"),
    "text for a number": (lambda file: file.attrs.__setitem__("dt_limit", "much"), "'dt_limit' has changed"),
    "the key": (lambda file: file.attrs.__setitem__("key", '{"beyond_limit'), "the attribute 'key' has changed"),
    "checksums": (lambda file: file.attrs.__setitem__("checksums", "{}"), "is cut off or damaged"),
    "no checksums": (lambda file: file.attrs.__delitem__("checksums"), "lacks the attribute 'checksums'"),
}


@pytest.mark.parametrize("fault", SPOILT)
def test_what_has_changed_is_damage_and_is_named(tmp_path, trusted, fault):
    """A change made through the library leaves a valid HDF5 file, whose own checksums are right again."""
    path, (spoil, told) = tmp_path / "a.h5", SPOILT[fault]
    stored = made_up_run.run().record
    write_record(path, stored)
    assert why_stale(path, stored.key, stored.fingerprint) is None
    with h5py.File(path, "r+") as file:
        spoil(file)
    with pytest.raises(DamagedFile) as problem:
        read_record(path)
    assert told in str(problem.value) and str(path) in str(problem.value) and "\n" not in str(problem.value)
    assert why_stale(path, stored.key, stored.fingerprint) == DAMAGED


@pytest.mark.parametrize("part", range(6))
def test_a_bit_that_flips_is_damage_or_means_nothing(tmp_path, part):
    """Told to be damaged, or everything in it is what it was; some bits send the library into an endless loop."""
    path, one = tmp_path / "a.h5", record()
    write_record(path, one)
    whole = path.read_bytes()
    place = (2 * part + 1) * len(whole) // 12
    path.write_bytes(whole[:place] + bytes([whole[place] ^ 1 << part]) + whole[place + 1 :])
    assert seal_of(path) is Seal.CHANGED
    if why_stale(path, KEY, "f" * 64) is None:
        assert_same(one, read_record(path))


def test_a_bit_among_the_numbers_is_always_damage(tmp_path, trusted):
    path, one = tmp_path / "a.h5", record()
    write_record(path, one)
    whole, values = path.read_bytes(), one.fields["snapshots/x"].values.tobytes()
    begin = whole.index(values)
    for place in range(begin, begin + len(values), 17):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        assert why_stale(path, KEY, "f" * 64) == DAMAGED
        with pytest.raises(DamagedFile):
            read_record(path, ["snapshots/x"])


def test_a_file_that_the_library_never_finishes_is_damaged(tmp_path, monkeypatch):
    path = tmp_path / "a.h5"
    write_record(path, record())
    with h5py.File(path, "r+") as file:
        file.attrs["note"] = "by hand"
    monkeypatch.setattr(opening, "PATIENCE", 0.01)
    with pytest.raises(DamagedFile, match="is cut off or damaged"):
        peek(path)
