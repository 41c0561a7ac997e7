"""An archive holds all that its charts need, describes each file, and draws the charts again; what is damaged, stale or
no archive is named in a sentence."""

import errno
import hashlib
import json
import os
import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import pandas as pd
import pytest

from studies.base.errors import StudyError
from studies.catalog import Chart
from studies.cli.commands import archive as archive_command
from studies.exchange.entry import ENTRY, entry_path, outside
from studies.metrics.timing import cases as timed
from studies.report.archive import packing
from studies.report.archive.checking import check
from studies.report.archive.packing import pack, pins
from studies.report.results import refresh
from studies.runs.current import case_path
from studies.store import archived, machine
from studies.store.ledger import Ledger
from studies.store.record import read_record, write_record
from studies.sweep.load import load_runs
from studies.sweep.run_studies import run_studies
from tests.studies.tiny import Silent, tiny_case, tiny_study

ROOT = Path(__file__).parents[4]
DAY = "2026-11-22"
STUDY = replace(
    tiny_study(columns=("volume_worst", "step_time", "real_time")),
    charts=(Chart("volume.png", "studies.plots.volume_history:draw"),),
)


@pytest.fixture(scope="session")
def packed(finished_sweep, tmp_path_factory):
    """The archive of the tiny study, with a chart; to be read, not changed."""
    target = tmp_path_factory.mktemp("archive") / "tiny.zip"
    pack(finished_sweep, [STUDY], target, DAY)
    return target


@pytest.fixture
def unpacked(packed, tmp_path):
    """A folder that it was unpacked to."""
    with zipfile.ZipFile(packed) as archive:
        archive.extractall(tmp_path / "unpacked")
    return tmp_path / "unpacked"


def test_what_is_in_it_is_what_was_stored_and_what_is_drawn_of_it(organbench, packed, unpacked, finished_sweep):
    files = {path.relative_to(unpacked).as_posix(): path for path in unpacked.rglob("*") if path.is_file()}
    records = {case_path(Path(), "tiny", case).as_posix() for case in STUDY.cases}
    frame_times = {timed.timing_file(Path(), "tiny", case).as_posix() for case in STUDY.cases[:2]}
    drawn = {"tiny/tiny.csv", "tiny/volume.png", "tiny/tiny.h5", "report.html"}
    about = {"README.md", "CITATION.cff", "constraints.txt", "machine.json", archived.CRATE, archived.MANIFEST}
    assert {name for name in files if not name.startswith("code/")} == records | frame_times | drawn | about
    for name in records:
        assert files[name].read_bytes() == (finished_sweep / name).read_bytes()
    assert files.pop(archived.MANIFEST).read_text().count("\n") == len(files) > 500
    assert check(unpacked) == check(packed) == len(files)
    assert organbench("archive", "--check", packed)[:2] == (0, f"{packed}: {len(files)} files, each as it was packed\n")


def test_charts_and_tables_are_drawn_again_on_another_machine_by_other_code(unpacked, monkeypatch):
    table, chart = unpacked / "tiny" / "tiny.csv", unpacked / "tiny" / "volume.png"
    before = table.read_bytes(), chart.read_bytes()
    assert pd.read_csv(table)["step_time [µs]"].notna().tolist() == [True, True, False]
    table.unlink()
    chart.unlink()
    for module in (machine, archived, timed):
        monkeypatch.setattr(module, "machine_id", lambda: "00000000")
    monkeypatch.setattr(timed, "case_fingerprint", lambda case: "of other code")
    assert refresh(Ledger(unpacked), STUDY)[1] == []
    assert (table.read_bytes(), chart.read_bytes()) == before


OWN_FILE = f"import sys\nsys.path.append({str(ROOT)!r})\nfrom {__name__} import STUDY\n"


@pytest.mark.campaign
def test_the_code_in_it_draws_by_itself(unpacked, tmp_path):
    """A process that knows no other code of organbench."""
    table = unpacked / "tiny" / "tiny.csv"
    before = table.read_bytes()
    table.unlink()
    file = tmp_path / "tiny_file.py"
    file.write_text(OWN_FILE)
    env = {**os.environ, "PYTHONPATH": str(unpacked / "code")}
    program = "import studies.__main__ as m; assert 'unpacked' in m.__file__, m.__file__; m.main()"
    command = [sys.executable, "-c", program, "report", str(file), "--results", str(unpacked)]
    subprocess.run(command, cwd=tmp_path, env=env, check=True, capture_output=True)
    assert table.read_bytes() == before


def test_the_metadata_are_those_of_a_crate_and_of_the_citation(unpacked):
    """The rules of RO-Crate 1.1 that a reader relies on."""
    data, cited = json.loads((unpacked / archived.CRATE).read_text()), packing.citation()
    entities = {entity["@id"]: entity for entity in data["@graph"]}
    head, root, table = (entities[name] for name in (archived.CRATE, "./", "tiny/tiny.csv"))
    assert data["@context"] == "https://w3id.org/ro/crate/1.1/context"
    assert head["about"] == {"@id": "./"} and head["conformsTo"]["@id"].endswith("/ro/crate/1.1")
    assert root["datePublished"] == DAY and root["description"].startswith(cited["abstract"])
    assert root["license"] == {"@id": f"https://spdx.org/licenses/{cited['license']}"}
    assert all((unpacked / part["@id"]).exists() for part in root["hasPart"])
    for value in (value for entity in data["@graph"] for value in entity.values()):
        for link in value if isinstance(value, list) else [value]:
            if isinstance(link, dict):
                assert link["@id"] in entities or link["@id"].startswith("https://w3id.org/")
    assert table["sha256"] == hashlib.sha256((unpacked / "tiny" / "tiny.csv").read_bytes()).hexdigest()
    assert (unpacked / "CITATION.cff").read_bytes() == (ROOT / "CITATION.cff").read_bytes()
    assert cited["version"] == version("organbench")


def test_equal_results_are_equal_bytes(packed, finished_sweep, tmp_path):
    pack(finished_sweep, [STUDY], tmp_path / "again.zip", DAY)
    assert (tmp_path / "again.zip").read_bytes() == packed.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["again.zip"]


def test_studies_of_files_are_named_and_not_left_out_silently(organbench, refused, results, tmp_path, monkeypatch):
    words = ("archive", "-o", tmp_path / "all.zip", "--results", results)
    assert f"in {results} only studies of files are stored (tiny); name them: FILE.py" in refused(*words)
    shutil.copytree(results / "tiny", results / "mine")
    monkeypatch.setattr(archive_command, "STUDIES", (STUDY, replace(STUDY, name="other")))
    code, out, err = organbench(*words)
    assert code == 0 and "warning: not packed: mine, of files; name them, as in `organbench archive FILE.py`" in err
    assert f": {check(tmp_path / 'all.zip')} files" in out


def test_entries_from_outside_are_packed_with_their_row(results, tmp_path):
    case = tiny_case()
    record = read_record(case_path(results, "tiny", case))
    entry = case.replaced(method=outside("other_program"))
    attributes = record.attributes | {ENTRY: "other_program"}
    write_record(entry_path(results, entry), replace(record, key=entry.key, name="other", attributes=attributes))
    pack(results, [STUDY], tmp_path / "a.zip", DAY)
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        assert entry_path(Path(), entry).as_posix() in archive.namelist()
        assert "other_program" in archive.read("tiny/tiny.csv").decode()


def test_versions_are_those_installed_and_the_citation_lies_next_to_the_code_or_is_missed(tmp_path, monkeypatch):
    lines = pins().splitlines()
    assert f"numpy=={version('numpy')}" in lines and not any(line.startswith("pytest==") for line in lines)
    monkeypatch.setattr(packing, "ROOT", tmp_path / "code")
    monkeypatch.setattr(packing, "DISTRIBUTION", "not-installed")
    with pytest.raises(StudyError, match=r"CITATION\.cff is missing"):
        packing.citation()
    (tmp_path / "CITATION.cff").write_text("")
    assert packing.citation_file() == tmp_path / "CITATION.cff"


def test_a_file_that_is_missing_or_changed_is_named(refused, unpacked):
    path = case_path(unpacked, "tiny", tiny_case())
    path.write_bytes(path.read_bytes()[:-1] + b"?")
    sentence = refused("archive", "--check", unpacked)
    assert f"tiny/{path.name} has changed since it was packed: get the archive again" in sentence
    path.unlink()
    assert f"{unpacked} lacks tiny/{path.name}" in refused("archive", "--check", unpacked)
    runs, remarks = load_runs(unpacked, STUDY)
    assert len(runs) == 2 and remarks == [f"case {tiny_case().name} is missing in the archive"]


def test_an_archive_that_was_cut_off_or_has_a_flipped_bit_is_one_sentence(refused, packed, tmp_path):
    content, file = bytearray(packed.read_bytes()), tmp_path / "bad.zip"
    for keep in (0.999, 0.0):
        file.write_bytes(content[: int(keep * len(content))])
        assert "bad.zip is cut off or damaged" in refused("archive", "--check", file)
    with zipfile.ZipFile(packed) as archive:
        entry = archive.getinfo("tiny/volume.png")
    content[entry.header_offset + 60 + entry.compress_size // 2] ^= 1
    file.write_bytes(content)
    assert "tiny/volume.png" in refused("archive", "--check", file)


BAD_WORDS = {
    "is not an archive of organbench": ("--check", "other.zip"),
    "it has no manifest-sha256.txt": ("--check", "."),
    "there is no archive": ("--check", "none.zip"),
    "nothing is stored in": ("--results", "."),
    "unknown study 'stres'": ("stres", "--results", "."),
    "an archive ends in .zip": ("stress", "-o", "a.tar", "--results", "."),
}


@pytest.mark.parametrize("message", BAD_WORDS)
def test_bad_words_are_one_sentence(refused, tmp_path, monkeypatch, message):
    monkeypatch.chdir(tmp_path)
    with zipfile.ZipFile("other.zip", "w") as other:
        other.writestr("a.txt", "")
    assert message in refused("archive", *BAD_WORDS[message])


def test_what_is_missing_damaged_or_stale_is_not_packed(results, tmp_path):
    path, target = case_path(results, "tiny", tiny_case()), tmp_path / "new.zip"
    stale = replace(read_record(path), fingerprint="0")
    for spoil in (lambda: write_record(path, stale), lambda: path.write_bytes(path.read_bytes()[:-9]), path.unlink):
        spoil()
        with pytest.raises(StudyError, match=rf"not archived: {tiny_case().name} is"):
            pack(results, [STUDY], target, DAY)
    assert not target.exists() and not list(tmp_path.glob("new-*"))


def test_nothing_runs_in_an_archive_none_is_packed_again_and_its_machine_is_needed(unpacked, tmp_path):
    with pytest.raises(StudyError, match="is an unpacked archive, which stays as it is"):
        run_studies(unpacked, [STUDY], 1, Silent())
    with pytest.raises(StudyError, match="is an unpacked archive"):
        pack(unpacked, [STUDY], tmp_path / "again.zip", DAY)
    for content in ("{", "[]", "{}", None):
        path = unpacked / "machine.json"
        path.unlink() if content is None else path.write_text(content)
        remarks = load_runs(unpacked, STUDY)[1]
        assert remarks and all("machine.json is" in remark for remark in remarks)


@pytest.mark.parametrize("place", ["shutil.copytree", "shutil.copyfileobj", "os.fsync"])
def test_a_full_disk_is_one_sentence_and_leaves_nothing(finished_sweep, tmp_path, monkeypatch, place):
    """While the code is gathered, while the zip is written, at its end."""
    module, name = place.split(".")

    def full(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr({"shutil": shutil, "os": os}[module], name, full)
    with pytest.raises(StudyError, match=r"the disk is full: free some space and run again"):
        pack(finished_sweep, [STUDY], tmp_path / "tiny.zip", DAY)
    assert list(tmp_path.iterdir()) == []
