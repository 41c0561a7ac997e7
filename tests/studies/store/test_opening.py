"""Files that were cut off, changed or written by others: named, never read as results."""

import h5py
import numpy as np
import pytest

from studies.base.errors import DamagedFile, OpenElsewhere, OtherVersion, StudyError
from studies.store import opening
from studies.store.entry import DAMAGED, read_entry
from studies.store.opening import FLAGS_AT, open_results, sealed
from studies.store.record import SCHEMA, Field, peek, read_record, write_record
from tests.studies import made_up_run
from tests.studies.store.test_record import record

MEGABYTE = 1 << 20


def change(path, by, seal=True):
    """Through the library, which leaves valid HDF5; seal: with the seal that others can make too."""
    with h5py.File(path, "r+") as file:
        by(file)
    if seal:
        path.write_bytes(sealed(path.read_bytes()))


def test_reading_changes_nothing(tmp_path):
    path = tmp_path / "a.h5"
    write_record(path, record())
    before = path.read_bytes()
    with open_results(path) as file, pytest.raises(OSError, match="no write intent"):
        file["t"][0] = 7.0
    assert read_record(path).name == record().name and path.read_bytes() == before


def test_a_cut_off_file_is_one_sentence_wherever_it_was_cut(tmp_path):
    path = tmp_path / "a.h5"
    write_record(path, record())
    whole = path.read_bytes()
    for size in {*range(0, 200, 7), *range(200, len(whole), 97), len(whole) - 1}:
        path.write_bytes(whole[:size])
        with pytest.raises(StudyError, match="cut off") as problem:
            read_record(path)
        assert "\n" not in str(problem.value)
        assert read_entry(path).fault == DAMAGED


def test_a_changed_byte_is_found_wherever_it_is_in_a_large_file(tmp_path):
    path = tmp_path / "a.h5"
    write_record(path, record(fields={"t": Field(np.ones(400_000), "s", "time of each frame")}))
    whole = path.read_bytes()
    assert len(whole) > 3 * MEGABYTE and peek(path).name == record().name
    for place in range(MEGABYTE // 2, len(whole), MEGABYTE):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        with pytest.raises(DamagedFile):
            peek(path)


def test_the_library_never_sees_a_changed_byte(tmp_path, monkeypatch):
    """Some bits send it into an endless loop."""
    path, opened = tmp_path / "a.h5", []
    write_record(path, record())
    whole = path.read_bytes()
    monkeypatch.setattr(opening.h5py, "File", lambda *words, **more: opened.append(words))
    for place in {*range(0, len(whole), 37), len(whole) - 1}:
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1 << place % 8]) + whole[place + 1 :])
        assert read_entry(path).fault == DAMAGED
    assert opened == []


def of_another_program(path):
    with h5py.File(path, "w") as file:
        file["x"] = 1.0


def of_version_0_2(path):
    """With its checksum in the user block of HDF5."""
    path.write_bytes(b"organbench results; bytes and SHA-256 of what follows these 512: 9".ljust(512, b"\0") + b"image")


FOREIGN = {
    "is not an HDF5 file, or was cut off": (DamagedFile, lambda path: path.write_text("hello")),
    "is an HDF5 file of another program": (OtherVersion, of_another_program),
    "of an earlier version of organbench": (OtherVersion, of_version_0_2),
    "is not a file": (DamagedFile, lambda path: path.mkdir()),
    "there is no results file": (StudyError, lambda path: None),
}


@pytest.mark.parametrize("sentence", FOREIGN)
def test_what_is_no_results_file_is_one_sentence(tmp_path, sentence):
    path, (kind, make) = tmp_path / "a.h5", FOREIGN[sentence]
    make(path)
    with pytest.raises(kind, match=sentence) as problem:
        peek(path)
    assert str(path) in str(problem.value) and "\n" not in str(problem.value)


@pytest.mark.parametrize("schema", [0, SCHEMA + 1, "old"])
def test_another_schema_is_refused(tmp_path, schema):
    path = tmp_path / "a.h5"
    write_record(path, record())
    change(path, lambda file: file.attrs.__setitem__("schema", schema))
    with pytest.raises(OtherVersion, match=f"has results schema {schema}, this version reads {SCHEMA}"):
        read_record(path)


def other_text(file):
    del file["volume"]
    file["volume"] = "none"
    file["volume"].attrs.update({"unit": "m^3", "description": "volume"})


def dangle(file):
    del file["volume"]
    file["volume"] = h5py.SoftLink("/nowhere")


def claim(file):
    del file["t"]
    file.create_dataset("t", (10**12,), float, fillvalue=1.0).attrs.update({"unit": "s", "description": "t"})


SPOILT = {
    "no field": (lambda file: file.__delitem__("volume"), "lacks 'volume'"),
    "soft link": (dangle, "/volume is a link"),
    "text": (other_text, "holds 'volume' as <U"),
    "a group": (lambda file: (file.__delitem__("rest"), file.create_group("rest")), "lacks 'rest'"),
    "no unit": (lambda file: file["t"].attrs.__delitem__("unit"), "is cut off or damaged"),
    "no key": (lambda file: file.attrs.__delitem__("key"), "is cut off or damaged"),
    "more than the file": (claim, "/t claims 8,000,000,000,000 bytes"),
    "text for a number": (lambda file: file.attrs.__setitem__("dt_limit", "much"), "has dt_limit = 'much'"),
}


@pytest.mark.parametrize("fault", SPOILT)
def test_what_no_record_holds_is_refused_under_any_seal(tmp_path, fault):
    path, (spoil, sentence) = tmp_path / "a.h5", SPOILT[fault]
    write_record(path, made_up_run.run().record)
    change(path, spoil)
    with pytest.raises(StudyError) as problem:
        read_record(str(path))
    assert sentence in str(problem.value) and str(path) in str(problem.value) and "\n" not in str(problem.value)


def test_what_is_changed_through_the_library_is_damage(tmp_path):
    path = tmp_path / "a.h5"
    write_record(path, made_up_run.run().record)
    change(path, lambda file: file.attrs.__setitem__("note", "looked at on Monday"), seal=False)
    assert read_entry(path).fault == DAMAGED


def test_a_file_that_another_program_has_open_is_that_and_stays(tmp_path):
    path = tmp_path / "a.h5"
    write_record(path, record())
    with h5py.File(path, "r+"):
        held = path.read_bytes()
        for touched in (peek, read_record, lambda path: write_record(path, record())):
            with pytest.raises(OpenElsewhere, match="is open for writing in another program"):
                touched(path)
        assert path.read_bytes() == held
    with pytest.raises(DamagedFile, match="has no checksum any more"):
        peek(path)


@pytest.mark.parametrize("bit", range(8))
def test_a_damaged_mark_is_damage_and_is_replaced(tmp_path, bit):
    """The byte that says that a program has the file open: with one bit of it flipped, all others are as written."""
    path = tmp_path / "a.h5"
    write_record(path, record())
    whole = path.read_bytes()
    path.write_bytes(whole[:FLAGS_AT] + bytes([whole[FLAGS_AT] ^ 1 << bit]) + whole[FLAGS_AT + 1 :])
    with pytest.raises(DamagedFile, match="is cut off or damaged"):
        read_record(path)
    write_record(path, record())
    assert path.read_bytes() == whole
