"""What is damaged, stale or no archive is named in one sentence, and an archive stays as it is."""

import zipfile
from dataclasses import replace

import pytest

from studies.base.errors import StudyError
from studies.report.archive.packing import pack
from studies.runs.current import case_path
from studies.store.record import read_record, write_record
from studies.sweep.load import load_runs
from studies.sweep.run_studies import run_studies
from tests.studies.report.archive.conftest import DAY, STUDY
from tests.studies.tiny import Silent, tiny_case


def test_a_file_that_is_missing_or_changed_is_named(refused, unpacked):
    path = case_path(unpacked, "tiny", tiny_case())
    content = path.read_bytes()
    path.write_bytes(content[:-1] + b"?")
    sentence = refused("archive", "--check", unpacked)
    assert f"tiny/{path.name} has changed since it was packed: get the archive again" in sentence
    path.unlink()
    assert f"{unpacked} lacks tiny/{path.name}" in refused("archive", "--check", unpacked)
    runs, remarks = load_runs(unpacked, STUDY)
    assert len(runs) == 2 and remarks == [f"case {tiny_case().name} is missing in the archive"]


@pytest.mark.parametrize("keep", [0.999, 0.5, 0.0])
def test_an_archive_that_was_cut_off_is_one_sentence(refused, packed, tmp_path, keep):
    content = packed.read_bytes()
    (tmp_path / "cut.zip").write_bytes(content[: int(keep * len(content))])
    assert "cut.zip is cut off or damaged" in refused("archive", "--check", tmp_path / "cut.zip")


def test_a_bit_that_flips_is_noticed(refused, packed, tmp_path):
    with zipfile.ZipFile(packed) as archive:
        entry = archive.getinfo("tiny/volume.png")
    content = bytearray(packed.read_bytes())
    content[entry.header_offset + 60 + entry.compress_size // 2] ^= 1
    (tmp_path / "bit.zip").write_bytes(content)
    assert "tiny/volume.png" in refused("archive", "--check", tmp_path / "bit.zip")


def test_what_is_no_archive_is_one_sentence(refused, tmp_path):
    with zipfile.ZipFile(tmp_path / "other.zip", "w") as other:
        other.writestr("a.txt", "")
    assert "is not an archive of organbench" in refused("archive", "--check", tmp_path / "other.zip")
    assert "is not an archive of organbench" in refused("archive", "--check", tmp_path)
    assert "there is no archive" in refused("archive", "--check", tmp_path / "none.zip")


def test_what_is_missing_damaged_or_stale_is_not_packed(results, tmp_path):
    path, target = case_path(results, "tiny", tiny_case()), tmp_path / "new.zip"
    record = read_record(path)
    for spoil, reason in (
        (lambda: write_record(path, replace(record, fingerprint="0")), "is stale"),
        (lambda: path.write_bytes(path.read_bytes()[:-9]), "is stale"),
        (path.unlink, "is missing"),
    ):
        spoil()
        with pytest.raises(StudyError, match=rf"not archived: {tiny_case().name} {reason}.*organbench run tiny"):
            pack(results, [STUDY], target, DAY)
    assert not target.exists() and not list(tmp_path.glob("new-*"))


def test_nothing_runs_in_an_archive_and_none_is_packed_again(unpacked, tmp_path):
    with pytest.raises(StudyError, match="is an unpacked archive, which stays as it is"):
        run_studies(unpacked, [STUDY], 1, Silent())
    with pytest.raises(StudyError, match="is an unpacked archive"):
        pack(unpacked, [STUDY], tmp_path / "again.zip", DAY)


@pytest.mark.parametrize("content", [None, "{", "[]", "{}"])
def test_an_archive_that_lost_its_machine_is_one_sentence(unpacked, content):
    path = unpacked / "machine.json"
    path.unlink() if content is None else path.write_text(content)
    remarks = load_runs(unpacked, STUDY)[1]
    assert remarks and all("machine.json is" in remark for remark in remarks)


def test_bad_words_are_one_sentence(refused, tmp_path):
    assert "nothing is stored in" in refused("archive", "--results", tmp_path)
    assert "unknown study 'stres'" in refused("archive", "stres", "--results", tmp_path)
    assert "an archive ends in .zip" in refused("archive", "stress", "-o", tmp_path / "a.tar", "--results", tmp_path)
