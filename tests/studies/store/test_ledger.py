"""The ledger of a results folder says what its files say, each read once."""

import os
from dataclasses import replace

import pytest

from studies.base.errors import DamagedFile
from studies.metrics.timing.cases import timing_file
from studies.runs import current
from studies.runs.current import case_path, run_fingerprint
from studies.store.entry import CASE_CHANGED, CODE_CHANGED, DAMAGED, MISSING, OTHER_VERSION, read_entry
from studies.store.ledger import Ledger
from studies.store.paths import record_files
from studies.store.record import peek, read_record, write_record
from studies.store.schema import Status
from studies.sweep.job import case_jobs
from studies.sweep.standings import standings
from tests.studies import made_up_run
from tests.studies.tiny import diverging_case, tiny_case, tiny_study

COUNT, NAME = 4, "many"
STUDY = tiny_study(name=NAME, cases=tuple(tiny_case(dt_fraction=0.1 + 0.1 * number) for number in range(COUNT)))


@pytest.fixture
def many(tmp_path):
    """A results folder with a made-up record for each case of STUDY."""
    record = replace(made_up_run.run().record, fingerprint=run_fingerprint())
    for case in STUDY.cases:
        write_record(case_path(tmp_path, NAME, case), replace(record, key=case.key, name=case.name))
    return tmp_path


def test_an_entry_says_what_the_record_says(many):
    for path in record_files(many, NAME):
        entry, record = read_entry(path), peek(path)
        assert entry == Ledger(many).files(NAME)[path.name]
        assert (entry.name, entry.status, entry.message) == (record.name, "ok", "")
        assert (entry.fingerprint, entry.machine) == (record.fingerprint, record.machine)
        assert entry.written.startswith(f"{path.name} {path.stat().st_size} ") and entry.fault == ""
        short = peek(path, ("dt", "nothing"))
        assert short.attributes == {"dt": record.attributes["dt"]} and short.fields == {}


def test_a_command_reads_each_file_once_and_again_when_it_looks_again(many, opened):
    first, second, third, *_ = record_files(many, NAME)
    ledger = Ledger(many)
    assert [standing.status for standing in standings(ledger, STUDY)] == ["ok"] * COUNT
    assert len(ledger.files(NAME)) == COUNT
    assert sorted(opened) == [path.name for path in record_files(many, NAME)]
    write_record(first, replace(read_record(first), status=Status.DIVERGED))
    first.with_name("copy.h5").write_bytes(second.read_bytes())
    third.unlink()
    assert ledger.files(NAME)[first.name].status == "ok", "what it has seen stays"
    ledger.look_again()
    files = ledger.files(NAME)
    assert files[first.name].status == "diverged" and third.name not in files
    assert files["copy.h5"].digest == files[second.name].digest


def test_a_file_changed_behind_its_back_is_seen_though_its_date_is_put_back(many):
    path = record_files(many, NAME)[0]
    before, whole = path.stat(), bytearray(path.read_bytes())
    whole[-9] ^= 1
    path.write_bytes(whole)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    entry = Ledger(many).files(NAME)[path.name]
    assert entry.fault == DAMAGED and isinstance(entry.error(), DamagedFile) and str(path) in entry.error_message


def test_what_is_no_results_file_is_not_among_them(many):
    names = set(Ledger(many).files(NAME))
    folder = many / NAME
    (folder / "self.h5").symlink_to(folder / "self.h5")
    for name in (f"{NAME}.h5", "table.csv", "a.h5.0123.part"):
        (folder / name).write_bytes(b"x")
    assert set(Ledger(many).files(NAME)) == names and Ledger(many).files("nothing") == {}


def test_why_names_each_reason_once(results):
    study = tiny_study(cases=(*tiny_study().cases, *(tiny_case(dt_fraction=f) for f in (0.4, 0.3, 0.2))))
    one, two, three, _, other, old = (case_path(results, "tiny", case) for case in study.cases)
    other.write_bytes(two.read_bytes())  # under the name of a case, another one
    write_record(one, replace(read_record(one), fingerprint="0" * 64))
    three.write_bytes(three.read_bytes()[:900])
    old.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(600))
    ledger, reasons = Ledger(results), [CODE_CHANGED, None, DAMAGED, MISSING, CASE_CHANGED, OTHER_VERSION]
    assert [ledger.why(job) for job in case_jobs(results, study)] == reasons
    assert "cut off" in ledger.files("tiny")[three.name].error_message
    assert str(old) in ledger.files("tiny")[old.name].error_message


def test_a_changed_source_makes_all_stale(many, monkeypatch):
    monkeypatch.setattr(current, "source_fingerprint", lambda *modules: "edited")
    assert {standing.message for standing in standings(Ledger(many), STUDY)} == {CODE_CHANGED}


def test_a_result_under_another_name_is_not_the_case(results):
    path = case_path(results, "tiny", diverging_case())
    path.rename(path.with_name(f"mine-{path.name[-11:]}"))
    (job,) = case_jobs(results, tiny_study(cases=(diverging_case(),)))
    assert Ledger(results).why(job) == MISSING


def test_a_timing_is_current_or_not_like_its_case(results):
    jobs = case_jobs(results, tiny_study())
    assert [Ledger(results).why_untimed(job) for job in jobs] == [None, None, MISSING]
    assert [Ledger(results).can_be_timed(job) for job in jobs] == [True, True, False]
    assert [Ledger(results).timed_somewhere(job) for job in jobs] == [True, True, True], "one diverges"
    timing_file(results, "tiny", jobs[0].work).unlink()
    assert Ledger(results).why_untimed(jobs[0]) == MISSING and not Ledger(results).timed_somewhere(jobs[0])
