"""A record is data: no path in it makes a program run."""

import hashlib
import json
from dataclasses import replace

import pytest

from studies.runs.current import case_path
from studies.store.record import read_record, write_record
from tests.studies.tiny import tiny_case


@pytest.fixture
def evil(tmp_path):
    """A program of a stranger that leaves a mark, and its SHA-256."""
    path = tmp_path / "evil.py"
    path.write_text(f"open({str(tmp_path / 'marker')!r}, 'w').close()\n")
    return path, hashlib.sha256(path.read_bytes()).hexdigest()


def record_that_names(results, own_files):
    """A record as a stranger may write it, with checksums that fit."""
    path = case_path(results, "tiny", tiny_case())
    record = read_record(path)
    write_record(path, replace(record, attributes=record.attributes | {"own_files": own_files}))
    return path


@pytest.mark.parametrize("digest", ["right", "wrong"])
@pytest.mark.parametrize("place", ["absolute", "relative", "in the folder above"])
def test_a_program_that_a_record_names_does_not_run(refused, results, evil, tmp_path, monkeypatch, place, digest):
    file, sha256 = evil
    name = {"absolute": str(file), "relative": "evil.py", "in the folder above": "../evil.py"}[place]
    record = record_that_names(results, json.dumps({name: sha256 if digest == "right" else "00"}))
    monkeypatch.chdir(results if place == "in the folder above" else tmp_path)
    sentence = refused("replay", record)
    assert "programs run only when you name them" in sentence and f"--file {name}" in sentence
    assert not (tmp_path / "marker").exists()


def test_it_runs_when_the_user_names_it_and_its_digest_fits(organbench, refused, results, evil, tmp_path):
    file, sha256 = evil
    record = record_that_names(results, json.dumps({"evil.py": sha256}))
    code, out, err = organbench("replay", record, "--file", file)
    assert code == 0 and "bit for bit" in out and not err
    assert (tmp_path / "marker").exists()
    (tmp_path / "marker").unlink()
    file.write_text(file.read_text() + "# another\n")
    sentence = refused("replay", record, "--file", file)
    assert "its content has changed" in sentence and "--changed" in sentence
    assert not (tmp_path / "marker").exists()
    code, out, err = organbench("replay", record, "--file", file, "--changed")
    assert code == 0 and "bit for bit" in out and "its content has changed" in err
    assert (tmp_path / "marker").exists()


def test_no_file_runs_before_the_digests_of_all_are_checked(refused, results, evil, tmp_path):
    file, sha256 = evil
    other = tmp_path / "other.py"
    other.write_text("x = 1\n")
    record = record_that_names(results, json.dumps({"evil.py": sha256, "other.py": "00"}))
    assert "other.py is not the file" in refused("replay", record, "--file", file, "--file", other)
    assert not (tmp_path / "marker").exists()


@pytest.mark.parametrize("text", ["[]", "{", '{"evil.py": 3}', '"evil.py"'])
def test_a_text_that_names_no_files_is_one_sentence(refused, results, text):
    assert "does not say which files it was made with" in refused("replay", record_that_names(results, text))


def test_no_other_command_runs_it(organbench, results, evil, tmp_path, tiny_file, monkeypatch):
    file, sha256 = evil
    record = record_that_names(results, json.dumps({str(file): sha256}))
    monkeypatch.chdir(tmp_path)
    for words in (("show", record, "--all"), ("show", tiny_file), ("table", tiny_file), ("report", tiny_file)):
        more = () if "--all" in words else ("--results", results)
        assert organbench(*words, *more)[0] == 0
    assert not (tmp_path / "marker").exists()
