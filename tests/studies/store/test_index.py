"""The index of a folder: what it says is what the files say; of those only what has changed is opened."""

import os
import sqlite3
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import replace

import pytest

from studies.base import shelf
from studies.bench.many_cases import NAME, make_up, many_study
from studies.store.index import folder as index_folder
from studies.store.index.entry import read_entry
from studies.store.index.folder import ENTRIES, FolderIndex, shelf_of
from studies.store.index.room import Room
from studies.store.paths import record_files
from studies.store.record import glance, peek, read_record, write_record
from studies.store.schema import Status
from studies.store.staleness import DAMAGED, OTHER_VERSION
from tests.studies import made_up_run

COUNT = 12


@pytest.fixture
def many(tmp_path):
    """A results folder with COUNT made-up records."""
    make_up(tmp_path, many_study(COUNT), made_up_run.run().record)
    return tmp_path


def entries(root):
    return FolderIndex(root, NAME).entries


def test_made_up_records_are_records(many):
    for path, case in zip(record_files(many, NAME), sorted(many_study(COUNT).cases, key=lambda c: c.name), strict=True):
        record = read_record(path)
        assert (record.key, record.name) == (case.key, case.name)


def test_an_entry_says_what_the_record_says(many):
    for path in record_files(many, NAME):
        entry, record = read_entry(path), peek(path)
        assert entry == entries(many)[path.name]
        assert (entry.kind, entry.name, entry.status, entry.message) == ("run", record.name, "ok", "")
        assert (entry.fingerprint, entry.machine) == (record.fingerprint, record.machine)
        assert (entry.size, entry.at_home, entry.fault) == (path.stat().st_size, True, "")


def test_a_glance_is_a_peek_with_fewer_attributes(many):
    path = record_files(many, NAME)[0]
    short, whole = glance(path, ("dt", "nothing")), peek(path)
    assert short.attributes == {"dt": whole.attributes["dt"]}
    assert (short.key, short.status, short.fields) == (whole.key, whole.status, {})


def test_a_file_is_opened_once(many, opened):
    assert len(entries(many)) == len(opened) == COUNT
    opened.clear()
    assert len(entries(many)) == COUNT and opened == []


def test_what_is_new_changed_or_gone_is_seen(many, opened):
    first, second, third, *_ = record_files(many, NAME)
    entries(many)
    opened.clear()
    record = read_record(first)
    write_record(first, replace(record, status=Status.DIVERGED))
    first.with_name("copy.h5").write_bytes(second.read_bytes())
    third.unlink()
    opened.clear()
    found = entries(many)
    assert set(opened) == {"copy.h5", first.name} and len(opened) == 2
    assert found[first.name].status == "diverged" and not found["copy.h5"].at_home and third.name not in found


def test_a_date_that_is_put_back_hides_no_change(many):
    """A change that keeps size and date, as tools that copy can make it."""
    path = record_files(many, NAME)[0]
    before = path.stat()
    assert entries(many)[path.name].fault == ""
    whole = bytearray(path.read_bytes())
    whole[-9] ^= 1
    path.write_bytes(whole)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert path.stat().st_mtime_ns == before.st_mtime_ns
    assert entries(many)[path.name].fault == DAMAGED


def test_every_fault_is_kept_with_its_sentence(many, opened):
    first, second, third, *_ = record_files(many, NAME)
    first.write_bytes(first.read_bytes()[:700])
    second.write_text("hello")
    third.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(600))
    for _ in range(2):
        found = entries(many)
        assert [found[path.name].fault for path in (first, second, third)] == [DAMAGED, DAMAGED, OTHER_VERSION]
        assert "cut off" in found[first.name].told and str(second) in found[second.name].told
    assert len(opened) == COUNT


def lose_silently(root, path):
    """Damages a file behind the back of the index, as a disk does that loses bits."""
    whole = bytearray(path.read_bytes())
    whole[-9] ^= 1
    path.write_bytes(whole)
    shelf, state = shelf_of(root, NAME), index_folder.state_of(path.stat())
    shelf.put(ENTRIES, {path.name: shelf.load(ENTRIES)[path.name]._replace(state=state)})


def test_a_full_check_finds_what_a_date_does_not_tell(many):
    path = record_files(many, NAME)[0]
    entries(many)
    lose_silently(many, path)
    assert entries(many)[path.name].fault == ""
    assert FolderIndex(many, NAME, check=True).entries[path.name].fault == DAMAGED
    assert entries(many)[path.name].fault == DAMAGED


@pytest.mark.parametrize("content", [b"", b"no database at all, but text that is long enough" * 99, "cut", "bits"])
def test_an_index_that_is_damaged_is_made_again(many, opened, content):
    expected = entries(many)
    path = shelf_of(many, NAME).path
    whole = path.read_bytes()
    damaged = {"cut": whole[: len(whole) // 2], "bits": whole[:5000] + bytes(3000) + whole[8000:]}
    path.write_bytes(damaged.get(content, content))
    assert entries(many) == expected
    opened.clear()
    assert entries(many) == expected and opened == []


def test_a_line_of_the_index_that_has_changed_is_not_believed(many, opened):
    expected = entries(many)
    with closing(sqlite3.connect(shelf_of(many, NAME).path)) as connection, connection:
        connection.execute("UPDATE kept SET text = replace(text, '\"ok\"', '\"no\"') WHERE rowid = 3")
    opened.clear()
    assert entries(many) == expected and len(opened) == 1


def test_an_index_of_another_version_is_made_again(many, opened, monkeypatch):
    expected = entries(many)
    monkeypatch.setattr(shelf, "VERSION", 2)
    opened.clear()
    assert entries(many) == expected and len(opened) == COUNT
    opened.clear()
    assert entries(many) == expected and opened == []


def test_what_entries_said_before_is_forgotten(many, monkeypatch):
    entries(many)
    monkeypatch.setattr(index_folder, "ENTRIES", "entries of schema 0: other words")
    entries(many)
    assert shelf_of(many, NAME).rooms() == ["entries of schema 0: other words"]


def no_folder(root, monkeypatch):
    (root / "cache").write_text("no folder")


def full(root, monkeypatch):
    opens = shelf.Shelf._opened

    def small(self):
        connection = opens(self)
        connection.execute("PRAGMA max_page_count = 1")
        return connection

    monkeypatch.setattr(shelf.Shelf, "_opened", small)


def held(root, monkeypatch):
    monkeypatch.setattr(shelf, "PATIENCE", 0.05)
    entries(root)
    other = sqlite3.connect(shelf_of(root, NAME).path, isolation_level=None, check_same_thread=False)
    other.execute("BEGIN EXCLUSIVE")
    monkeypatch.setattr(sqlite3, "kept_open", other, raising=False)


@pytest.mark.parametrize("hinder", [no_folder, full, held])
def test_where_no_index_can_be_kept_everything_is_read_and_that_is_said(many, monkeypatch, hinder):
    monkeypatch.setattr(index_folder, "MANY", COUNT - 1)
    hinder(many, monkeypatch)
    with pytest.warns(UserWarning, match=f"cannot be kept .*reads all {COUNT} files"):
        found = entries(many)
    assert {entry.status for entry in found.values()} == {"ok"} and len(found) == COUNT


def test_commands_at_once_find_the_same(many):
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: entries(many), range(16)))
    assert all(one == found[0] for one in found) and len(found[0]) == COUNT


def test_a_room_measures_again_what_has_changed(many):
    path, measured = record_files(many, NAME)[0], []

    def value(depends):
        room = Room(FolderIndex(many, NAME), "sizes")
        found = [
            room.get(file, depends, lambda file=file: measured.append(file) or len(file)) for file in entries(many)
        ]
        room.keep()
        return found

    assert value("code 1") == value("code 1") and len(measured) == COUNT
    write_record(path, read_record(path))
    value("code 1")
    assert measured[COUNT:] == [path.name]
    value("code 2")
    assert len(measured) == 2 * COUNT + 1
    path.unlink()
    value("code 2")
    assert path.name not in shelf_of(many, NAME).load("sizes")
