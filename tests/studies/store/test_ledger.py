"""The ledger of a results folder says what its files say, and opens only files that have changed."""

import os
import sqlite3
import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from studies.metrics.metric import Metric
from studies.metrics.table import frame_of, metric, study_table
from studies.metrics.timing.cases import timing_file
from studies.report.kept_volume import kept_volumes
from studies.report.results import refresh
from studies.runs import current
from studies.runs.current import case_path, run_fingerprint
from studies.store import ledger as module
from studies.store.entry import CASE_CHANGED, CODE_CHANGED, DAMAGED, MISSING, OTHER_VERSION, read_entry
from studies.store.ledger import SETS, Ledger
from studies.store.links import link_study
from studies.store.paths import record_files
from studies.store.record import glance, peek, read_record, write_record
from studies.store.schema import Status
from studies.sweep.job import case_jobs, jobs_of
from studies.sweep.load import References, load_runs
from studies.sweep.plan import plan
from studies.sweep.rows import table_rows
from studies.sweep.run_studies import run_studies
from studies.sweep.standings import standings, warnings_of
from tests.studies import made_up_run
from tests.studies.tiny import Silent, diverging_case, tiny_case, tiny_study

COUNT, NAME = 12, "many"
STUDY = tiny_study(
    name=NAME,
    cases=tuple(tiny_case(dt_fraction=0.1 + 0.01 * number) for number in range(COUNT)),
    columns=("volume_worst", "volume_end", "min_j"),
)
COLUMNS = [metric(name) for name in STUDY.columns]


@pytest.fixture
def many(tmp_path):
    """A results folder with a made-up record for each case of STUDY."""
    record = replace(made_up_run.run().record, fingerprint=run_fingerprint())
    for case in STUDY.cases:
        write_record(case_path(tmp_path, NAME, case), replace(record, key=case.key, name=case.name))
    return tmp_path


def entries(root):
    return Ledger(root).files(NAME)


def statuses(root):
    return [standing.status for standing in standings(Ledger(root), STUDY)]


def rows(root, metrics=COLUMNS):
    return table_rows(References(Ledger(root)), STUDY, metrics)[0]


def test_an_entry_says_what_the_record_says(many):
    for path in record_files(many, NAME):
        entry, record = read_entry(path), peek(path)
        assert entry == entries(many)[path.name]
        assert (entry.kind, entry.name, entry.status, entry.message) == ("run", record.name, "ok", "")
        assert (entry.fingerprint, entry.machine) == (record.fingerprint, record.machine)
        assert (entry.size, entry.fault) == (path.stat().st_size, "")
        short = glance(path, ("dt", "nothing"))
        assert short.attributes == {"dt": record.attributes["dt"]} and short.fields == {}


def test_each_command_opens_a_file_once_or_not_at_all(many, opened):
    assert statuses(many) == ["ok"] * COUNT and len(opened) == COUNT
    opened.clear()
    ledger = Ledger(many)
    assert statuses(many) == ["ok"] * COUNT
    assert plan(ledger, STUDY) == [] and run_studies(many, [STUDY], 1, Silent()) == 0
    assert warnings_of(ledger, STUDY) == [] and link_study(ledger, NAME) == []
    assert opened == []
    assert len(rows(many)) == COUNT and len(opened) == COUNT
    opened.clear()
    assert len(rows(many)) == COUNT and opened == []
    assert kept_volumes(ledger, [STUDY]).equals(kept_volumes(ledger, [STUDY])) and len(opened) == COUNT
    refresh(ledger, STUDY)
    opened.clear()
    refresh(Ledger(many), STUDY)
    assert opened == []


def test_a_deleted_ledger_is_made_again_with_the_same_answers(many, opened, monkeypatch, recwarn):
    monkeypatch.setattr(module, "MANY", 0)
    expected = entries(many)
    Ledger(many).path.unlink()
    opened.clear()
    assert entries(many) == expected and len(opened) == COUNT
    assert entries(many) == expected and len(opened) == COUNT
    assert not recwarn.list


def test_an_index_of_the_version_before_is_ignored(many, opened):
    """It lay in cache/index, a file for each study."""
    old = many / "cache" / "index" / f"{NAME}.sqlite"
    old.parent.mkdir(parents=True)
    with closing(sqlite3.connect(old)) as connection:
        connection.execute("CREATE TABLE kept (room TEXT, name TEXT, state TEXT, text TEXT, sum INTEGER)")
    before = old.read_bytes()
    assert statuses(many) == ["ok"] * COUNT and old.read_bytes() == before
    old.unlink()
    opened.clear()
    assert statuses(many) == ["ok"] * COUNT and opened == []


def test_what_is_new_changed_or_gone_is_seen(many, opened):
    first, second, third, *_ = record_files(many, NAME)
    ledger = Ledger(many)
    before = ledger.files(NAME)
    write_record(first, replace(read_record(first), status=Status.DIVERGED))
    first.with_name("copy.h5").write_bytes(second.read_bytes())
    third.unlink()
    opened.clear()
    assert ledger.files(NAME) is before, "a command sees the folder as it was"
    ledger.look_again()
    for files in (ledger.files(NAME), entries(many)):
        assert files[first.name].status == "diverged" and third.name not in files
        assert files["copy.h5"].digest == files[second.name].digest
        assert sorted(opened) == sorted(["copy.h5", first.name])


def test_a_file_changed_behind_its_back_is_seen_though_its_date_is_put_back(many):
    path = record_files(many, NAME)[0]
    assert entries(many)[path.name].fault == ""
    before = path.stat()
    whole = bytearray(path.read_bytes())
    whole[-9] ^= 1
    path.write_bytes(whole)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert path.stat().st_mtime_ns == before.st_mtime_ns and path.stat().st_size == before.st_size
    assert entries(many)[path.name].fault == DAMAGED


@pytest.mark.parametrize("column", ["size", "mtime", "ctime", "inode"])
def test_a_file_is_read_again_when_anything_of_its_state_differs(many, opened, column):
    expected = entries(many)
    with closing(sqlite3.connect(Ledger(many).path)) as database, database:
        database.execute(f"UPDATE files SET status = 'failed', {column} = {column} + 1 WHERE rowid = 3")
    opened.clear()
    assert entries(many) == expected and len(opened) == 1


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


def test_a_changed_source_makes_all_stale_without_opening_one(many, opened, monkeypatch):
    statuses(many)
    opened.clear()
    monkeypatch.setattr(current, "source_fingerprint", lambda *modules: "edited")
    ledger = Ledger(many)
    assert {standing.message for standing in standings(ledger, STUDY)} == {CODE_CHANGED}
    assert len(plan(ledger, STUDY)) == COUNT and opened == []


def test_a_result_under_another_name_is_not_the_case(results):
    path = case_path(results, "tiny", diverging_case())
    path.rename(path.with_name(f"mine-{path.name[-11:]}"))
    (job,) = case_jobs(results, tiny_study(cases=(diverging_case(),)))
    assert Ledger(results).why(job) == MISSING


def test_a_result_is_one_job_in_many_studies(tmp_path):
    twice = replace(STUDY, cases=(*STUDY.cases, *STUDY.cases))
    assert len(jobs_of(tmp_path, [twice])) == COUNT
    assert len(jobs_of(tmp_path, [STUDY, replace(STUDY, name="other")])) == 2 * COUNT


def test_a_timing_is_current_or_not_like_its_case(results):
    jobs = case_jobs(results, tiny_study())
    assert [Ledger(results).why_untimed(job) for job in jobs] == [None, None, MISSING]
    assert [Ledger(results).can_be_timed(job) for job in jobs] == [True, True, False]
    timing_file(results, "tiny", jobs[0].work).unlink()
    assert Ledger(results).why_untimed(jobs[0]) == MISSING


def lose_silently(root, path):
    """Damages a file so that its state in the ledger is that of the damaged file, as a disk does that loses bits."""
    whole = bytearray(path.read_bytes())
    whole[-9] ^= 1
    path.write_bytes(whole)
    with closing(sqlite3.connect(Ledger(root).path)) as database, database:
        values = (path.stat().st_mtime_ns, path.stat().st_ctime_ns, path.name)
        database.execute("UPDATE files SET mtime = ?, ctime = ? WHERE file = ?", values)


def test_status_check_reads_every_byte(organbench, many):
    study = many / "many.py"
    study.write_text("from tests.studies.store.test_ledger import STUDY\n")
    path = record_files(many, NAME)[0]
    assert organbench("show", study, "--results", many)[1].startswith(f"many: {COUNT} cases: {COUNT} ok\n")
    lose_silently(many, path)
    assert organbench("show", study, "--results", many)[1].startswith(f"many: {COUNT} cases: {COUNT} ok\n")
    code, out, _ = organbench("show", study, "--check", "--results", many)
    assert code == 0 and out.startswith(f"many: {COUNT} cases: {COUNT - 1} ok, 1 stale\n  stale: {DAMAGED}\n")
    assert f"{COUNT - 1} ok, 1 stale" in organbench("show", study, "--results", many)[1]


def test_the_first_reader_marks_lost_bits_for_all(many):
    path = record_files(many, NAME)[0]
    statuses(many)
    lose_silently(many, path)
    assert statuses(many) == ["ok"] * COUNT
    _, remarks = table_rows(References(Ledger(many)), STUDY, COLUMNS)
    assert len(remarks) == 1 and path.name in remarks[0]
    assert sorted(statuses(many)) == ["ok"] * (COUNT - 1) + ["stale"]


@pytest.mark.parametrize("content", [b"", b"no database at all, but text that is long enough" * 99, "cut", "zeros"])
def test_a_damaged_ledger_is_made_again(many, opened, content):
    expected = entries(many)
    path = Ledger(many).path
    whole = path.read_bytes()
    damaged = {"cut": whole[: len(whole) // 2], "zeros": whole[:4096] + bytes(4096) + whole[8192:]}
    path.write_bytes(damaged.get(content, content))
    opened.clear()
    assert entries(many) == expected and len(opened) == COUNT
    opened.clear()
    assert entries(many) == expected and opened == []


def test_a_ledger_of_another_layout_is_made_again(many, opened, monkeypatch):
    expected = entries(many)
    rows(many)
    monkeypatch.setattr(module, "LAYOUT", 1)
    opened.clear()
    assert entries(many) == expected and len(opened) == COUNT
    opened.clear()
    assert entries(many) == expected and opened == []


def no_folder(root, monkeypatch):
    (root / "cache").write_text("no folder")


def limit_connections(monkeypatch, pragma):
    connect = sqlite3.connect

    def limited(*args, **options):
        connection = connect(*args, **options)
        connection.execute(pragma)
        return connection

    monkeypatch.setattr(sqlite3, "connect", limited)


def full(root, monkeypatch):
    limit_connections(monkeypatch, "PRAGMA max_page_count = 2")


def held(root, monkeypatch):
    monkeypatch.setattr(module, "PATIENCE", 0.05)
    entries(root)
    other = sqlite3.connect(Ledger(root).path, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    monkeypatch.setattr(sqlite3, "kept_open", other, raising=False)


def read_only(root, monkeypatch):
    entries(root)
    for path in record_files(root, NAME):
        write_record(path, read_record(path))
    limit_connections(monkeypatch, "PRAGMA query_only = 1")


@pytest.mark.parametrize("hinder", [no_folder, full, held, read_only])
def test_where_no_ledger_can_be_written_it_is_in_memory_and_many_files_are_a_warning(many, monkeypatch, hinder):
    hinder(many, monkeypatch)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert statuses(many) == ["ok"] * COUNT
    monkeypatch.setattr(module, "MANY", COUNT - 1)
    ledger = Ledger(many)
    with pytest.warns(UserWarning, match=f"cannot be written .*reads all {COUNT} files"):
        files = ledger.files(NAME)
    assert {entry.status for entry in files.values()} == {"ok"} and len(files) == COUNT
    assert ledger.files(NAME) is files


def test_commands_at_once_find_the_same(many):
    """In threads, each with a ledger of its own, and in other processes."""
    program = "import sys; from pathlib import Path; from studies.store.ledger import Ledger\n"
    program += f"print(len(Ledger(Path(sys.argv[1])).files({NAME!r})))"
    env = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    command = [sys.executable, "-W", "error", "-c", program, str(many)]
    others = [subprocess.Popen(command, env=env, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    with ThreadPoolExecutor(8) as pool:
        listings = list(pool.map(lambda _: entries(many), range(16)))
    assert all(one == listings[0] for one in listings) and len(listings[0]) == COUNT
    assert [other.communicate()[0] for other in others] == [f"{COUNT}\n"] * 2


def test_two_writers_keep_the_lines_of_both(many, opened):
    one, two = Ledger(many), Ledger(many)
    assert one.files(NAME) == two.files(NAME)
    first, second = record_files(many, NAME)[:2]
    write_record(first, replace(read_record(first), status=Status.DIVERGED))
    one.look_again()
    one.files(NAME)
    write_record(second, replace(read_record(second), status=Status.DIVERGED))
    two.look_again()
    two.files(NAME)
    opened.clear()
    files = entries(many)
    assert [files[path.name].status for path in (first, second)] == ["diverged"] * 2 and opened == []


def test_a_kept_row_is_the_row_of_the_run(results):
    study = tiny_study(columns=("volume_worst", "step_time", "min_j"))
    metrics = [metric(name) for name in study.columns]
    expected = study_table(load_runs(results, study)[0], study.columns)
    for _ in range(2):
        assert frame_of(table_rows(References(Ledger(results)), study, metrics)[0]).equals(expected)
    timing_file(results, "tiny", study.cases[0]).unlink()
    left = frame_of(table_rows(References(Ledger(results)), study, metrics)[0])
    assert left["step_time [µs]"].isna().tolist() == [True, False, True]


def test_one_changed_record_is_one_measured_row(many, opened):
    rows(many)
    path = record_files(many, NAME)[0]
    changed, kept = made_up_run.run(volume=(1.0, 1.5, 1.0, 1.0)).record, read_record(path)
    write_record(path, replace(changed, key=kept.key, name=kept.name, fingerprint=kept.fingerprint))
    opened.clear()
    table = rows(many)
    assert opened == [path.name] * 2  # for its line, and for its metrics
    assert sorted(row["volume_worst [%]"] for row in table)[-2:] == [0.0, pytest.approx(50.0)]


def test_rows_are_measured_again_for_other_metrics_and_a_changed_reference(many, monkeypatch):
    measured = []
    own = Metric("count", "1", "-", lambda run: measured.append(1) or 1.0)
    assert frame_of(rows(many, [own])).equals(frame_of(rows(many, [own]))) and len(measured) == COUNT
    assert set(rows(many, COLUMNS[:1])[0]) < set(rows(many)[0])
    monkeypatch.setattr(Ledger, "state", lambda self, jobs: "solved again")
    rows(many, [own])
    assert len(measured) == 2 * COUNT


def test_measured_values_are_kept_for_a_few_sets_and_go_with_their_files(many):
    ledger, calls = Ledger(many), []
    files = dict.fromkeys(ledger.files(NAME), "code")

    def measure(file):
        calls.append(file)
        return None if file == min(files) else len(file)

    for number in range(SETS + 2):
        assert len(ledger.measured(NAME, f"set {number}", files, measure)) == COUNT - 1
    calls.clear()
    ledger.measured(NAME, f"set {SETS + 1}", files, measure)
    assert calls == [min(files)], "no value is not kept"
    ledger.measured(NAME, "set 0", files, measure)
    assert len(calls) == 1 + COUNT, "the oldest sets are gone"
    record_files(many, NAME)[1].unlink()
    entries(many)
    with closing(sqlite3.connect(ledger.path)) as database:
        counts = database.execute("SELECT count(*) FROM measured GROUP BY what").fetchall()
    assert counts == [(COUNT - 2,)] * SETS
