"""A method, a law, a scene, a metric and a chart in a user's file: the example of CONTRIBUTING, run as it stands."""

import json

import pytest

from studies.report.page.part import read_part
from studies.report.results import refresh
from studies.runs import user_code
from studies.runs.current import case_path
from studies.runs.recipes import TetrahedralBody
from studies.runs.run import measure
from studies.runs.user_code import files_of, given_files, load_given
from studies.store.ledger import Ledger
from studies.store.record import Status, read_record
from studies.sweep.find_study import find_study
from tests.studies.tiny import tiny_case
from tests.test_docs import code

EXAMPLE = code("CONTRIBUTING.md", "Keep it in a file of your own")


@pytest.fixture(autouse=True)
def alone():
    """Names that another test has given are free again."""
    user_code.forget()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("own")


@pytest.fixture
def mine(folder):
    """The example as a file, in one place for all tests: records name it."""
    path = folder / "mine.py"
    path.write_text(EXAMPLE)
    return path


def edit(path, before, after):
    text = path.read_text()
    assert before in text
    path.write_text(text.replace(before, after))


@pytest.fixture
def ran(organbench, mine, folder):
    """Results of the example, which runs in the first test that asks."""
    results = folder / "results"
    code, _, err = organbench("run", mine, "--results", results, "--jobs", 1)
    assert code == 0, err
    return results


def test_it_runs_and_is_current_and_its_records_name_the_file(organbench, mine, ran):
    _, out, err = organbench("show", mine, "--results", ran)
    assert out.startswith("calm: 3 cases: 3 ok\n") and not err
    study = find_study(str(mine))
    records = [read_record(case_path(ran, "calm", case)) for case in study.cases]
    assert [record.status for record in records] == [Status.OK] * 3
    named = {str(mine): user_code.read_code(mine).sha256}
    assert [json.loads(record.attributes.get("own_files", "{}")) for record in records] == [{}, named, named]
    assert records[2].attributes["law"] == "bars"
    assert len(list(ran.glob("calm/*.timing.*.h5"))) == 1
    assert (ran / "calm" / "force.png").stat().st_size > 10_000


def test_its_table_has_its_metric(organbench, mine, ran):
    _, out, _ = organbench("table", mine, "--results", ran, "--metrics", "force_mean")
    study = find_study(str(mine))
    record = read_record(case_path(ran, "calm", study.cases[1]))
    force = record.fields["contact_force"].values[:, 0, 2].mean()
    (row,) = [line for line in out.splitlines() if "calm share0.2" in line]
    assert float(row.split()[-1]) == pytest.approx(-force, rel=1e-2)
    assert "force_mean [N]" in (ran / "calm" / "calm.csv").read_text()


EDITS = {
    "a comment": ("share: float = 0.1", "share: float = 0.1  # a tenth", "1 ok, 2 stale"),
    "the method": ("1.0 - self.share", "1.0 - 0.5 * self.share", "1 ok, 2 stale"),
    "the law": ("1.0 / edges.length,", "1.0 / edges.length**2,", "1 ok, 2 stale"),
    "the scene": ("-1.62", "-1.63", "3 missing"),
}


@pytest.mark.parametrize("what", EDITS)
def test_an_edit_makes_stale_what_uses_the_file(organbench, mine, ran, what):
    before, after, counts = EDITS[what]
    edit(mine, before, after)
    assert organbench("show", mine, "--results", ran)[1].startswith(f"calm: 3 cases: {counts}\n")


def test_an_edit_of_a_module_beside_it_does_too(mine):
    before = user_code.read_code(mine).fingerprint
    edit(mine, "from typing import ClassVar", "from typing import ClassVar\nfrom helpers import tenth")
    (mine.parent / "helpers.py").write_text("tenth = 0.1\n")
    with_helper = user_code.read_code(mine).fingerprint
    (mine.parent / "helpers.py").write_text("tenth = 0.2\n")
    assert len({before, with_helper, user_code.read_code(mine).fingerprint}) == 3


def test_a_new_chart_or_metric_is_drawn_without_running(organbench, mine, ran):
    edit(mine, '"N", "-", force_mean', '"kN", "-", lambda run: 1e-3 * force_mean(run)')
    edit(mine, "figure.savefig(path)", 'path.write_text("no picture")')
    path = case_path(ran, "calm", find_study(str(mine)).cases[0])
    before = path.stat().st_mtime_ns
    organbench("report", mine, "--results", ran)
    assert (ran / "calm" / "force.png").read_text() == "no picture"
    assert "force_mean [kN]" in (ran / "calm" / "calm.csv").read_text()
    assert path.stat().st_mtime_ns == before


NAMES = {
    "method": ('"calm"\n    share', '"free"\n    share', "method 'free' is one of the project's own"),
    "law": ("def bars", "def uniform", "law 'uniform' is one of the project's own"),
    "metric": ('Metric("force_mean"', 'Metric("min_j"', "metric 'min_j' is one of the project's own"),
    "quantity": ('"-", force_mean', '"-", force_mean, "forse"', "unknown quantity of a reference in metric"),
    "no law": ("StiffnessLaw(bars)", "bars", "give a StiffnessLaw"),
    "notebook": ("StiffnessLaw(bars)", "StiffnessLaw(eval('lambda e, m: e', {}))", "is not written in a file"),
}


@pytest.mark.parametrize("what", NAMES)
def test_a_name_that_is_taken_is_refused(refused, mine, tmp_path, what):
    before, after, message = NAMES[what]
    edit(mine, before, after)
    if what == "law":
        edit(mine, "StiffnessLaw(bars)", "StiffnessLaw(uniform)")
    assert message in refused("run", mine, "--results", tmp_path / "none")


def test_two_files_with_one_name_are_refused(refused, mine, tmp_path):
    other = tmp_path / "other.py"
    other.write_text(EXAMPLE)
    assert "law 'bars' is defined in" in refused("run", mine, other, "--results", tmp_path / "none")


FAILS = "mine.py fails: "
FAULTS = {
    "method": ("after = super()", "after = 1 / 0 or super()", 1, FAILS + "ZeroDivisionError in line 22: division by"),
    "law": ("return edges.matched", "raise KeyError from edges.matched", 2, FAILS + "TypeError in line 29: exception"),
    "not finite": ("1.0 / edges.length,", "0.0 * edges.length / 0,", 2, "law 'bars' gives stiffnesses of shape"),
}


@pytest.mark.parametrize("what", FAULTS)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_fault_in_it_is_a_result_with_its_line(mine, what):
    before, after, case, message = FAULTS[what]
    edit(mine, before, after)
    record = measure(find_study(str(mine)).cases[case])
    assert record.status == Status.FAILED and message in record.message and str(mine) in record.attributes["own_files"]


def test_a_worker_runs_what_this_process_has_read(mine):
    case = find_study(str(mine)).cases[2]
    files = given_files([case])
    assert files == ((str(mine), EXAMPLE.encode()),)
    mine.write_text("broken (")
    module = type(case.method).__module__
    user_code.forget()
    load_given(files)
    assert type(user_code.methods_by_name()["calm"]()).__module__ == module


def test_compiled_code_is_kept_by_the_state_of_the_kernels(mine, monkeypatch):
    """numba files what it compiles under the name of the module: another kernel, another name."""
    before = user_code.read_code(mine).module
    monkeypatch.setattr(user_code, "source_fingerprint", lambda *modules: "edited")
    assert user_code.read_code(mine).module != before


def test_a_method_and_a_law_name_their_file_each_alone_and_ours_none(mine):
    calm, ours = find_study(str(mine)).cases[1].method, tiny_case().method
    bodies = [TetrahedralBody(law=law) for law in ("bars", "van_gelder")]
    named = [files_of(tiny_case(body=body, method=method)) for method in (calm, ours) for body in bodies]
    assert [[file.path for file in files] for files in named] == [[mine], [mine], [mine], []]


def test_lines_of_the_page_name_the_file(mine, ran):
    """Both run the case again: from the study, and bit for bit from its record, with the file that its method is in."""
    study = find_study(str(mine))
    refresh(Ledger(ran), study)
    part = read_part(ran, study)
    assert part is not None
    for case, name in zip(part["cases"].values(), (case.name for case in study.cases), strict=True):
        assert case["run"] == f"organbench run {mine.name} --case {name}"
    assert [case["again"].endswith(f".h5 --file {mine.name}") for case in part["cases"].values()] == [
        bool(files_of(case)) for case in study.cases
    ]
    assert any(" --file " in case["again"] for case in part["cases"].values())
