"""Very many cases are looked after without opening their files again: counted in files, not in seconds."""

from dataclasses import replace

import pytest

from massspring import Free
from studies.bench.many_cases import NAME, make_up, many_study
from studies.metrics.metric import Metric
from studies.metrics.metrics import METRICS
from studies.metrics.table import frame_of, metric, study_table
from studies.report.kept_volume import kept_volumes
from studies.report.results import refresh
from studies.runs import current
from studies.runs.current import case_path
from studies.store.index import folder as index_folder
from studies.store.links import link_study
from studies.store.paths import index_path, record_files
from studies.store.record import read_record, write_record
from studies.store.staleness import CASE_CHANGED, CODE_CHANGED, DAMAGED, MISSING, why_stale
from studies.sweep.find_study import find_study
from studies.sweep.load import load_runs
from studies.sweep.plan import plan
from studies.sweep.run_studies import run_studies
from studies.sweep.standings import standings, warnings_of
from studies.sweep.stored import known as module
from studies.sweep.stored.known import Known
from studies.sweep.stored.rows import MOST_ROOMS, ROOM, table_rows
from studies.sweep.tasks import Task, tasks_of
from studies.timing.cases import timing_file
from tests.studies import made_up_run
from tests.studies.store.test_index import lose_silently
from tests.studies.tiny import Silent, diverging_case, tiny_case, tiny_study

COUNT = 10
STUDY = many_study(COUNT)
COLUMNS = [metric(name) for name in STUDY.columns]


@pytest.fixture
def many(tmp_path):
    make_up(tmp_path, STUDY, made_up_run.run().record)
    return tmp_path


def statuses(root, study=STUDY):
    return [standing.status for standing in standings(root, study)]


def rows(root, metrics=COLUMNS):
    return table_rows(Known(root), STUDY, metrics)[0]


def test_each_command_opens_a_file_once_or_not_at_all(many, opened):
    assert statuses(many) == ["ok"] * COUNT and len(opened) == COUNT
    opened.clear()
    assert statuses(many) == ["ok"] * COUNT
    assert plan(many, STUDY) == [] and run_studies(many, [STUDY], 1, Silent()) == 0
    assert warnings_of(many, STUDY) == [] and link_study(many, NAME) == []
    assert opened == []
    assert len(rows(many)) == COUNT and len(opened) == COUNT
    opened.clear()
    assert len(rows(many)) == COUNT and opened == []
    assert kept_volumes(many, [STUDY]).equals(kept_volumes(many, [STUDY])) and len(opened) == COUNT


def test_what_is_shown_already_is_looked_at_and_not_opened(many, opened):
    refresh(many, STUDY)
    opened.clear()
    refresh(many, STUDY)
    assert opened == []


def test_a_changed_source_makes_all_stale_without_opening_one(many, opened, monkeypatch):
    statuses(many)
    opened.clear()
    monkeypatch.setattr(current, "source_fingerprint", lambda *modules: "edited")
    assert {standing.message for standing in standings(many, STUDY)} == {CODE_CHANGED}
    assert len(plan(many, STUDY)) == COUNT and opened == []


def test_one_changed_record_is_one_opened_file(many, opened):
    rows(many)
    path = record_files(many, NAME)[0]
    changed = made_up_run.run(volume=(1.0, 1.5, 1.0, 1.0)).record
    kept = read_record(path)
    write_record(path, replace(changed, key=kept.key, name=kept.name, fingerprint=kept.fingerprint))
    opened.clear()
    found = rows(many)
    assert opened == [path.name] * 2  # by the index, and for its metrics
    assert sorted(row["volume_worst [%]"] for row in found)[-2:] == [0.0, pytest.approx(50.0)]


def test_the_same_word_as_the_file_itself_gives(results):
    """Whatever is wrong: the index says of every piece what reading its file says."""
    study = tiny_study(cases=(*tiny_study().cases, tiny_case(dt_fraction=0.4), tiny_case(dt_fraction=0.3)))
    one, two, three, _, other = (case_path(results, "tiny", case) for case in study.cases)
    record = read_record(one)
    other.write_bytes(two.read_bytes())  # under the name of a case, another one
    write_record(one, replace(record, fingerprint="0" * 64))
    three.write_bytes(three.read_bytes()[:900])
    known = Known(results)
    said = {task.label: known.why_stale(task) for task in tasks_of(results, [study])}
    assert said == {task.label: task.why_stale() for task in tasks_of(results, [study])}
    assert set(said.values()) == {None, CODE_CHANGED, DAMAGED, MISSING, CASE_CHANGED}


def test_a_copy_under_another_name_is_not_the_case(results):
    path = case_path(results, "tiny", diverging_case())
    path.rename(path.with_name(f"mine-{path.name[-11:]}"))
    assert Known(results).of_case("tiny", diverging_case()) is None
    path.with_name(f"mine-{path.name[-11:]}").rename(path)
    path.with_name(f"mine-{path.name[-11:]}").write_bytes(path.read_bytes())
    entry = Known(results).of_case("tiny", diverging_case())
    assert entry is not None and entry.file == path.name


def test_frame_times_are_known_as_their_files_say(results):
    study, known = tiny_study(), Known(results)
    one, two, three = study.cases
    assert [known.why_untimed("tiny", case) for case in (one, two)] == [None, None]
    assert not known.can_be_timed("tiny", three)
    timing_file(results, "tiny", one).unlink()
    assert Known(results).why_untimed("tiny", one) == MISSING
    assert why_stale(timing_file(results, "tiny", one), one.key, current.case_fingerprint(one)) == MISSING


def test_a_kept_row_is_the_row_of_the_run(results):
    study = tiny_study(columns=("volume_worst", "step_time", "min_j"))
    metrics = [metric(name) for name in study.columns]
    expected = study_table(load_runs(results, study)[0], study.columns)
    for _ in range(2):
        assert frame_of(table_rows(Known(results), study, metrics)[0]).equals(expected)
    timing_file(results, "tiny", study.cases[0]).unlink()
    left = frame_of(table_rows(Known(results), study, metrics)[0])
    assert left["step_time [µs]"].isna().tolist() == [True, False, True]


def test_rows_of_other_metrics_are_other_rows_and_the_sets_are_few(many):
    assert set(rows(many, COLUMNS[:1])[0]) < set(rows(many)[0])
    for entry in METRICS[:8]:
        rows(many, [entry])
    shelf = index_folder.shelf_of(many, NAME)
    assert len([room for room in shelf.rooms() if room.startswith(ROOM)]) == MOST_ROOMS


def test_a_reference_that_changed_measures_anew(many, monkeypatch):
    measured = []
    own = Metric("count", "1", "-", lambda run: measured.append(1) or 1.0)
    rows(many, [own]), rows(many, [own])
    assert len(measured) == COUNT
    monkeypatch.setattr("studies.sweep.stored.references.References.state", lambda self, scene: "solved again")
    rows(many, [own])
    assert len(measured) == 2 * COUNT


def test_lost_bits_are_found_by_who_reads_them_and_then_by_all(many):
    path = record_files(many, NAME)[0]
    statuses(many)
    lose_silently(many, path)
    assert statuses(many) == ["ok"] * COUNT
    _, remarks, _ = table_rows(Known(many), STUDY, COLUMNS)
    assert len(remarks) == 1 and path.name in remarks[0]
    assert sorted(statuses(many)) == ["ok"] * (COUNT - 1) + ["stale"]


def test_status_check_reads_every_byte(organbench, many):
    study = many / "many.py"
    study.write_text(f"from studies.bench.many_cases import many_study\nSTUDY = many_study({COUNT})\n")
    path = record_files(many, NAME)[0]
    assert organbench("status", study, "--results", many)[1].startswith(f"many: {COUNT} cases: {COUNT} ok\n")
    lose_silently(many, path)
    assert organbench("status", study, "--results", many)[1].startswith(f"many: {COUNT} cases: {COUNT} ok\n")
    code, out, _ = organbench("status", study, "--check", "--results", many)
    assert code == 0 and out.startswith(f"many: {COUNT} cases: {COUNT - 1} ok, 1 stale\n  stale: {DAMAGED}\n")
    assert f"{COUNT - 1} ok, 1 stale" in organbench("status", study, "--results", many)[1]


def test_a_study_of_many_cases_is_checked_once_for_each_part(tmp_path, monkeypatch):
    checked = []
    monkeypatch.setattr("studies.sweep.find_study._check_stored", lambda name, case: checked.append(case))
    (tmp_path / "many.py").write_text("from studies.bench.many_cases import many_study\nSTUDY = many_study(500)\n")
    assert len(find_study(str(tmp_path / "many.py")).cases) == 500
    assert len(checked) == 1


def test_a_piece_is_found_once_in_many_studies(tmp_path):
    twice = replace(STUDY, cases=(*STUDY.cases, *STUDY.cases))
    assert len(tasks_of(tmp_path, [twice])) == COUNT
    assert len(tasks_of(tmp_path, [STUDY, replace(STUDY, name="other")])) == 2 * COUNT


def test_the_code_of_a_method_is_looked_up_once(many, monkeypatch):
    asked = []
    own = module.case_fingerprint
    monkeypatch.setattr(module, "case_fingerprint", lambda case: asked.append(case) or own(case))
    known = Known(many)
    for case in (*STUDY.cases, *(case.replaced(method=Free()) for case in STUDY.cases)):
        assert known.why_stale(Task(many, NAME, case)) == (None if case in STUDY.cases else MISSING)
    assert len(asked) == 2


def test_the_links_of_a_study_are_those_of_its_files(many, opened):
    link_study(many, NAME)
    assert index_path(many, NAME).is_file()
    opened.clear()
    link_study(many, NAME)
    assert opened == []
