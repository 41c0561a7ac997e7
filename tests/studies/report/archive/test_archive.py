"""An archive holds all that its charts need, describes each file, and draws the charts again."""

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
from studies.cli.commands import archive as archive_command
from studies.exchange.entry import ENTRY, entry_path, outside
from studies.metrics.timing import cases as timed
from studies.report.archive import crate
from studies.report.archive.checking import check
from studies.report.archive.packing import chosen, pack, pins
from studies.report.results import draw_charts, refresh
from studies.runs.current import case_path
from studies.store import archived, machine
from studies.store.ledger import Ledger
from studies.store.record import read_record, write_record
from tests.studies.report.archive.conftest import DAY, STUDY
from tests.studies.tiny import tiny_case

ROOT = Path(__file__).parents[4]


def test_what_is_in_it(unpacked, finished_sweep):
    names = {path.relative_to(unpacked).as_posix() for path in unpacked.rglob("*") if path.is_file()}
    records = {case_path(Path(), "tiny", case).as_posix() for case in STUDY.cases}
    frame_times = {timed.timing_file(Path(), "tiny", case).as_posix() for case in STUDY.cases[:2]}
    drawn = {"tiny/tiny.csv", "tiny/volume.png", "tiny/tiny.h5", "kept_volume.csv", "report.html"}
    about = {"README.md", "CITATION.cff", "constraints.txt", "machine.json", archived.CRATE, archived.MANIFEST}
    assert {name for name in names if not name.startswith("code/")} == records | frame_times | drawn | about
    for name in records:
        assert (unpacked / name).read_bytes() == (finished_sweep / name).read_bytes()


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


@pytest.mark.campaign
def test_the_code_in_it_draws_by_itself(unpacked, tmp_path):
    """A process that knows no other code of organbench."""
    table = unpacked / "tiny" / "tiny.csv"
    before = table.read_bytes()
    table.unlink()
    file = tmp_path / "tiny_file.py"
    file.write_text(STUDY_FILE)
    env = {**os.environ, "PYTHONPATH": str(unpacked / "code")}
    program = "import studies.__main__ as m; assert 'unpacked' in m.__file__, m.__file__; m.main()"
    command = [sys.executable, "-c", program, "report", str(file), "--results", str(unpacked)]
    subprocess.run(command, cwd=tmp_path, env=env, check=True, capture_output=True)
    assert table.read_bytes() == before


STUDY_FILE = f"""
import sys
sys.path.append({str(ROOT)!r})
from tests.studies.report.archive.conftest import STUDY
"""


def test_the_manifest_names_every_file(unpacked):
    lines = (unpacked / archived.MANIFEST).read_text().splitlines()
    digests = {name: digest for digest, name in (line.split("  ") for line in lines)}
    files = {path.relative_to(unpacked).as_posix(): path for path in unpacked.rglob("*") if path.is_file()}
    del files[archived.MANIFEST]
    assert digests == {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in files.items()}


def test_the_metadata_are_those_of_a_crate(unpacked):
    """The rules of RO-Crate 1.1 that a reader relies on."""
    data = json.loads((unpacked / archived.CRATE).read_text())
    assert data["@context"] == "https://w3id.org/ro/crate/1.1/context"
    entities = {entity["@id"]: entity for entity in data["@graph"]}
    assert len(entities) == len(data["@graph"])
    head, root = entities[archived.CRATE], entities["./"]
    assert head["about"] == {"@id": "./"} and head["conformsTo"]["@id"].endswith("/ro/crate/1.1")
    assert root["datePublished"] == DAY and {"name", "description", "license"} <= root.keys()
    parts = [part["@id"] for part in root["hasPart"]]
    assert all((unpacked / part).exists() for part in parts) and "tiny/tiny.csv" in parts
    for value in (value for entity in data["@graph"] for value in entity.values()):
        for link in value if isinstance(value, list) else [value]:
            if isinstance(link, dict):
                assert link["@id"] in entities or link["@id"].startswith("https://w3id.org/")
    assert entities["tiny/tiny.csv"]["encodingFormat"] == "text/csv"
    assert {"@id": "tiny/volume.png"} in entities["#run-tiny"]["result"]


def test_equal_results_are_equal_bytes(packed, finished_sweep, tmp_path):
    pack(finished_sweep, [STUDY], tmp_path / "again.zip", DAY)
    assert (tmp_path / "again.zip").read_bytes() == packed.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["again.zip"]


def test_a_whole_archive_passes_the_check(organbench, packed, unpacked):
    count = check(packed)
    assert check(unpacked) == count > 500
    assert organbench("archive", "--check", packed)[:2] == (0, f"{packed}: {count} files, each as it was packed\n")


def test_all_that_is_stored_is_chosen(finished_sweep):
    assert chosen(finished_sweep, [STUDY, replace(STUDY, name="other")]) == [STUDY]


def test_studies_of_files_are_named_and_not_left_out_silently(organbench, refused, results, tmp_path, monkeypatch):
    words = ("archive", "-o", tmp_path / "all.zip", "--results", results)
    assert f"in {results} only studies of files are stored (tiny); name them: FILE.py" in refused(*words)
    shutil.copytree(results / "tiny", results / "mine")
    monkeypatch.setattr(archive_command, "STUDIES", (STUDY,))
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


def test_a_study_file_is_packed_with_its_records(organbench, results, tiny_file, tmp_path):
    organbench("run", tiny_file, "--results", results)
    target = tmp_path / "new" / "tiny.zip"
    code, out, err = organbench("archive", tiny_file, "-o", target, "--results", results)
    assert code == 0 and out.startswith(f"{target}: ")
    assert err.startswith("warning: report.html: chart picture.txt is omitted"), "it is no picture"
    with zipfile.ZipFile(target) as archive:
        assert archive.read(tiny_file.name) == tiny_file.read_bytes()
        assert archive.read("tiny/picture.txt") == b"3 runs"


def test_the_versions_are_those_installed():
    lines = pins().splitlines()
    assert lines[0].startswith(f"# organbench {version('organbench')}, Python 3.")
    assert f"numpy=={version('numpy')}" in lines and f"llvmlite=={version('llvmlite')}" in lines
    assert not any(line.startswith("pytest==") for line in lines)


def test_an_archive_is_cited_as_the_repository(unpacked):
    file = ROOT / "CITATION.cff"
    assert (unpacked / "CITATION.cff").read_bytes() == file.read_bytes()
    cited, entities = crate.citation(), json.loads((unpacked / archived.CRATE).read_text())["@graph"]
    assert cited["version"] == version("organbench")
    (root,) = (entity for entity in entities if entity["@id"] == "./")
    assert root["description"].startswith(cited["abstract"])
    assert root["license"] == {"@id": f"https://spdx.org/licenses/{cited['license']}"}


def test_the_citation_lies_next_to_the_code_of_an_archive(tmp_path, monkeypatch):
    monkeypatch.setattr(crate, "ROOT", tmp_path / "code")
    (tmp_path / "CITATION.cff").write_text("")
    assert crate.citation_file() == tmp_path / "CITATION.cff"


def test_a_missing_citation_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr(crate, "ROOT", tmp_path / "code")
    monkeypatch.setattr(crate, "DISTRIBUTION", "not-installed")
    with pytest.raises(StudyError, match=r"CITATION\.cff is missing: install organbench again"):
        crate.citation()


def test_charts_are_drawn_into_the_folder_that_is_named(packed, tmp_path):
    """The chart of the archive shows its records: drawn of other runs it is another one."""
    with zipfile.ZipFile(packed) as archive:
        shown = archive.read("tiny/volume.png")
    (path,) = draw_charts(tmp_path, STUDY, [])
    assert path.read_bytes() != shown
