"""The repository holds copies of current results; git ignores what a user computes."""

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from studies.base.errors import StudyError
from studies.catalog import STUDIES, Chart
from studies.cli.commands import publish as command
from studies.cli.commands import report as report_command
from studies.metrics.timing.cases import timing_file
from studies.report import publish as publishing
from studies.report.publish import EXTRAS, PUBLISHED, Extra, between, check, publish, publish_some
from studies.report.published_code import CURRENT, FILE, STALE, UNKNOWN, noted, study_code
from studies.report.sentences import Sentences
from studies.report.summaries import SUMMARIES
from studies.runs import current as runs
from studies.runs.current import case_path
from studies.store import stamps
from studies.store.machine import machine_id, machine_of
from studies.store.stamps import is_stamped, set_stamp
from tests.studies.tiny import tiny_case, tiny_study

REPOSITORY = Path(__file__).parents[3]
BEGIN, END = MARKS = SUMMARIES[0].marks
PAGE = SUMMARIES[0].page
HEADLINE = replace(
    tiny_study(charts=(Chart("one.png", lambda runs, path: path.write_bytes(b"a picture")),)), name="volume_loss"
)


@pytest.fixture(autouse=True)
def two_tables(monkeypatch):
    """That belong to no study."""
    monkeypatch.setitem(EXTRAS, "bench.csv", Extra("make bench", ("studies.runs.run",)))
    monkeypatch.setitem(EXTRAS, "geometry.csv", Extra("make geometry", ("studies.geometry.mesh.quality",)))


@pytest.fixture
def current(results):
    """Results of a study that has the name of the headline study, all current."""
    shutil.move(results / "tiny", results / "volume_loss")
    return results


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A repository's folder with the page of the headline table, and no page with findings in words."""
    monkeypatch.setattr(publishing, "SENTENCES", ())
    page = tmp_path / "home" / PAGE
    page.parent.mkdir(parents=True)
    page.write_text(f"# Title\n{BEGIN}\nold\n{END}\n")
    return tmp_path / "home"


@pytest.fixture
def small_population(monkeypatch):
    """Drawing the real one takes seconds."""
    monkeypatch.setattr(command, "find_study", lambda name: replace(HEADLINE, name=name))


def shown(home):
    """Name and content of all that is published, and of the page."""
    return {path.relative_to(home).as_posix(): path.read_bytes() for path in home.rglob("*") if path.is_file()}


def test_tables_charts_and_the_summary_are_copied(current, home):
    copies, absent = publish(current, [HEADLINE], home)
    names = {copy.relative_to(home / PUBLISHED).as_posix() for copy in copies}
    files = {"volume_loss/one.png", "volume_loss/volume_loss.csv", "summary.md", "kept_volume.csv", "machine.json"}
    assert names == {*files, FILE} and absent == list(EXTRAS)
    for name in files:
        assert (home / PUBLISHED / name).read_bytes() == (current / name).read_bytes()
    text = (home / PAGE).read_text()
    assert (current / "summary.md").read_text() in text and "old" not in text
    assert not list((home / PUBLISHED).rglob("*.h5"))


def test_findings_in_words_follow_the_tables_that_were_published(current, home, monkeypatch):
    def worst(published: Path) -> list[str]:
        return [(published / "volume_loss" / "volume_loss.csv").read_text().splitlines()[0].split(",")[0]]

    begin, end = (findings := Sentences("README.md", "findings", ("volume_loss",), worst)).marks
    monkeypatch.setattr(publishing, "SENTENCES", (findings, replace(findings, page="none.md", studies=("laws",))))
    (home / "README.md").write_text(f"# Title\n{begin}\nold\n{end}\nthe rest\n")
    publish(current, [HEADLINE], home)
    assert (home / "README.md").read_text() == f"# Title\n{begin}\n- scene\n{end}\nthe rest\n"


def test_what_nothing_makes_any_more_goes_and_what_was_not_made_again_stays(current, home):
    for name in ("volume_loss/older.png", "verify/verify.csv", "bench.csv", "population/population.csv"):
        (home / PUBLISHED / name).parent.mkdir(parents=True, exist_ok=True)
        (home / PUBLISHED / name).write_text("old")
    (home / PUBLISHED / FILE).write_text('{"verify": "hash"}')
    (current / "bench.csv").write_text("new")
    set_stamp(current, "bench.csv")
    publish(current, [HEADLINE], home)
    assert not (home / PUBLISHED / "volume_loss/older.png").exists()
    assert (home / PUBLISHED / "verify/verify.csv").read_text() == "old"
    assert (home / PUBLISHED / "population/population.csv").read_text() == "old"
    assert (home / PUBLISHED / "bench.csv").read_text() == "new"
    digests = noted(home / PUBLISHED)
    assert digests["verify"] == "hash" and "bench.csv" in digests


def miss(root, monkeypatch):
    case_path(root, HEADLINE.name, tiny_case()).unlink()


def miss_a_timing(root, monkeypatch):
    timing_file(root, HEADLINE.name, tiny_case(timed=True)).unlink()


def change_the_code(root, monkeypatch):
    monkeypatch.setattr(runs, "run_fingerprint", lambda: "another code")


def leave_an_old_bench(root, monkeypatch):
    (root / "bench.csv").write_text("of unknown age")


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (miss, r"is missing; run `organbench run volume_loss` first"),
        (miss_a_timing, r"the frame time of tiny_squeeze\S+ is missing or stale; run `organbench run volume_loss`"),
        (change_the_code, r"is stale, and 4 more are missing or stale; run `organbench run volume_loss`"),
        (leave_an_old_bench, r"bench.csv was made by other code; run `make bench`"),
    ],
)
def test_stale_or_missing_results_are_refused_before_anything_is_written(current, home, monkeypatch, spoil, sentence):
    before = shown(home)
    spoil(current, monkeypatch)
    with pytest.raises(StudyError, match=sentence):
        publish(current, [HEADLINE], home)
    assert shown(home) == before


def test_a_readme_without_marks_is_refused_before_anything_is_written(current, home):
    (home / PAGE).write_text("# Title\n")
    with pytest.raises(StudyError, match="has no lines"):
        publish(current, [HEADLINE], home)
    assert [*shown(home)] == [PAGE]


def test_the_command_publishes_where_it_stands_or_says_one_sentence(current, home, organbench, monkeypatch):
    monkeypatch.chdir(home)
    monkeypatch.setattr(command, "STUDIES", (HEADLINE,))
    code, out, err = organbench("publish", "--results", current)
    assert (code, err) == (0, "") and str(PUBLISHED / "volume_loss" / "one.png") in out
    assert "kept as published: verify: python -m studies.lab.verify; figures: organbench report" in out
    before = shown(home)
    miss(current, monkeypatch)
    code, out, err = organbench("publish", "--results", current)
    assert code == 2 and err.startswith("organbench: not published: ") and err.count("\n") == 1
    assert shown(home) == before


def test_report_leaves_readme_and_what_is_published_alone(current, home, organbench, monkeypatch):
    monkeypatch.chdir(home)
    before = shown(home)
    monkeypatch.setattr(report_command, "STUDIES", (HEADLINE,))
    assert organbench("report", "--results", current)[0] == 0
    assert (current / "summary.md").is_file() and shown(home) == before


def test_report_shows_a_study_of_a_file_beside_those_of_the_catalogue(results, organbench, monkeypatch, tiny_file):
    monkeypatch.setattr(report_command, "STUDIES", ())
    code, out, _ = organbench("report", tiny_file, "--results", results)
    assert code == 0 and str(results / "tiny" / "tiny.csv") in out.replace("\n", "")
    page = (results / "report.html").read_text(encoding="utf-8")
    assert "tiny squeeze" in page and f"<code>organbench run {tiny_file.name}</code>" in page


def test_a_stamp_holds_for_the_code_of_its_makers(tmp_path, monkeypatch):
    bench, meshes = EXTRAS["bench.csv"].makers, EXTRAS["geometry.csv"].makers
    assert not is_stamped(tmp_path, "bench.csv", bench)
    set_stamp(tmp_path, "bench.csv")
    assert is_stamped(tmp_path, "bench.csv", bench) and not is_stamped(tmp_path, "geometry.csv", meshes)
    hashes = stamps.source_hashes

    def edited(module):
        return lambda *makers: {name: "edited" if name == module else text for name, text in hashes(*makers).items()}

    monkeypatch.setattr(stamps, "source_hashes", edited("studies.report.sentences"))
    assert is_stamped(tmp_path, "bench.csv", bench), "no benchmark writes sentences"
    monkeypatch.setattr(stamps, "source_hashes", edited("massspring.methods.implicit_volume"))
    assert not is_stamped(tmp_path, "bench.csv", bench)
    monkeypatch.undo()
    path = tmp_path / "cache" / "bench.csv.made"
    path.write_text(path.read_text()[:-9])
    assert not is_stamped(tmp_path, "bench.csv", bench), "a stamp that was cut off"


def test_git_sees_what_is_published_and_nothing_else_below_results(tmp_path):
    """Fresh clone, any run: `git status` stays clean."""
    shutil.copy(REPOSITORY / ".gitignore", tmp_path)
    subprocess.run(["git", "init", "--quiet"], cwd=tmp_path, check=True)
    own = ["summary.md", "machine.json", "kept_volume.csv", "reference/uncertainty.csv", "reference/uncertainty.png"]
    own += ["cache/meshes/a.npz", "cache/a.drawn.json", "smoke/verify/verify.md", "verify/kappa.png", *EXTRAS]
    own += [f"{study.name}/{name}" for study in STUDIES for name in (f"{study.name}.csv", "a.h5", "a.timing.b.h5")]
    own += [f"{study.name}/{chart.file}" for study in STUDIES for chart in study.charts]
    paths = ["results/" + name for name in own] + [(PUBLISHED / name).as_posix() for name in own]
    ignored = subprocess.run(
        ["git", "check-ignore", *paths], cwd=tmp_path, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    assert ignored == paths[: len(own)]


def test_a_table_goes_between_its_marks():
    text = f"# Title\n{BEGIN}\nold\n{END}\ntail\n"
    once = between(text, MARKS, "\n| new |\n", Path("README.md"))
    assert once == f"# Title\n{BEGIN}\n| new |\n{END}\ntail\n"
    assert between(once, MARKS, "| new |", Path("README.md")) == once
    with pytest.raises(StudyError, match=r"README.md has no lines"):
        between("# Title\n", MARKS, "| new |", Path("README.md"))


def test_some_studies_are_published_and_all_else_stays(current, home, organbench, monkeypatch):
    monkeypatch.chdir(home)
    for name in ("other/other.csv", "volume_loss/older.png", "kept_volume.csv"):
        (home / PUBLISHED / name).parent.mkdir(parents=True, exist_ok=True)
        (home / PUBLISHED / name).write_text("old")
    monkeypatch.setattr("studies.sweep.find_study.STUDIES", (HEADLINE,))
    code, out, _ = organbench("publish", "volume_loss", "--results", current)
    assert code == 0 and "one.png" in out and "old" not in (home / PAGE).read_text()
    left = {path.relative_to(home / PUBLISHED).as_posix() for path in (home / PUBLISHED).rglob("*") if path.is_file()}
    assert left == {
        "other/other.csv",
        "kept_volume.csv",
        "summary.md",
        "volume_loss/one.png",
        "volume_loss/volume_loss.csv",
        FILE,
    }
    assert organbench("publish", "volume_los", "--results", current)[0] == 2


def test_a_study_of_a_file_is_published_too(results, home, organbench, monkeypatch, tiny_file):
    monkeypatch.chdir(home)
    assert organbench("publish", tiny_file, "--results", results)[0] == 0
    assert (home / PUBLISHED / "tiny/tiny.csv").read_bytes() == (results / "tiny/tiny.csv").read_bytes()


def test_a_study_that_another_machine_measured_says_so_in_its_folder(current, home):
    (home / PUBLISHED).mkdir(parents=True)
    (home / PUBLISHED / "machine.json").write_text('{"id": "another"}')
    publish_some(current, [HEADLINE], home)
    assert machine_of(home / PUBLISHED) == machine_of(home / PUBLISHED, "elsewhere") == "another"
    assert machine_of(home / PUBLISHED, HEADLINE.name) == machine_id()
    publish_some(current, [HEADLINE], home)
    assert (home / PUBLISHED / HEADLINE.name / "machine.json").is_file(), "a second time removes nothing"


@pytest.mark.parametrize("summary", SUMMARIES, ids=lambda summary: summary.name)
def test_the_pages_of_the_project_have_the_marks(summary):
    text = (REPOSITORY / summary.page).read_text(encoding="utf-8")
    begin, end = summary.marks
    assert text.index(begin) < text.index(end)


def status_of(home, *studies):
    return {one.name: one.status for one in check(home, studies)}


def test_what_is_published_is_current_until_the_code_that_makes_it_changes(current, home, monkeypatch):
    bench = current / "bench.csv"
    bench.write_text("new")
    set_stamp(current, "bench.csv")
    publish(current, [HEADLINE], home)
    block = f"{PAGE}, {BEGIN}"
    names = ["volume_loss", "volume_loss/one.png", "summary.md", "bench.csv", "kept_volume.csv", block]
    assert status_of(home, HEADLINE) == dict.fromkeys(names, CURRENT)
    # Another case, another table.
    other = replace(HEADLINE, cases=HEADLINE.cases[:-1])
    assert status_of(home, other) == dict.fromkeys(names, STALE) | {"bench.csv": CURRENT, block: CURRENT}
    # Other code of one maker.
    monkeypatch.setitem(EXTRAS, "bench.csv", replace(EXTRAS["bench.csv"], makers=("studies.geometry.mesh.quality",)))
    assert status_of(home, HEADLINE) == dict.fromkeys(names, CURRENT) | {"bench.csv": STALE}
    # A page that somebody edited.
    (home / PAGE).write_text((home / PAGE).read_text().replace(f"{BEGIN}\n", f"{BEGIN}\nby hand\n"))
    assert status_of(home, HEADLINE)[block] == STALE
    # What was published before codes were noted.
    (home / PUBLISHED / FILE).unlink()
    assert status_of(home, HEADLINE)["volume_loss"] == UNKNOWN


def test_other_code_of_a_run_makes_a_study_stale(current, home, monkeypatch):
    publish_some(current, [HEADLINE], home)
    assert noted(home / PUBLISHED)["volume_loss"] == study_code(HEADLINE)
    monkeypatch.setattr(runs, "run_fingerprint", lambda: "another code")
    assert status_of(home, HEADLINE)["volume_loss"] == STALE


def test_other_code_of_a_chart_makes_the_chart_stale_and_not_its_table(current, home):
    publish_some(current, [HEADLINE], home)
    chart = HEADLINE.charts[0]
    assert f"{HEADLINE.name}/{chart.file}" in noted(home / PUBLISHED)
    other = replace(HEADLINE, charts=(replace(chart, drawing="studies.plots.pieces:draw"), *HEADLINE.charts[1:]))
    stale = {name for name, status in status_of(home, other).items() if status == STALE}
    assert stale == {f"{HEADLINE.name}/{chart.file}"}


def test_other_code_of_a_text_makes_the_text_stale_and_not_its_study(current, home, monkeypatch):
    publish_some(current, [HEADLINE], home)
    members, text = SUMMARIES[3].text, SUMMARIES[0]  # of another module
    monkeypatch.setattr(publishing, "SUMMARIES", (replace(text, text=members),))
    assert status_of(home, HEADLINE)["summary.md"] == STALE
    assert status_of(home, HEADLINE)["volume_loss"] == CURRENT


@pytest.mark.parametrize("summary", SUMMARIES, ids=lambda summary: summary.name)
def test_the_code_of_every_published_text_is_noted(summary):
    assert summary.file in noted(REPOSITORY / PUBLISHED)


@pytest.mark.usefixtures("small_population")
def test_the_command_says_what_is_behind_with_exit_code_1(current, home, organbench, monkeypatch):
    monkeypatch.chdir(home)
    monkeypatch.setattr(command, "STUDIES", (HEADLINE,))
    publish_some(current, [HEADLINE], home)
    code, out, _ = organbench("publish", "--check")
    assert code == 0 and "volume_loss: current" in out and "4 of 4 are current" in out
    (home / PUBLISHED / FILE).write_text("{}")
    code, out, _ = organbench("publish", "volume_loss", "--check")
    assert code == 1 and "volume_loss: unknown, published before its code was noted; run `organbench run" in out
    assert "volume_loss/one.png: unknown" in out and "0 of 2 are current" in out


@pytest.mark.usefixtures("small_population")
def test_a_published_file_that_nothing_makes_is_named(home, refused, monkeypatch):
    monkeypatch.chdir(home)
    assert "there is no results/published; run the command" in refused("publish", "--check")
    (home / PUBLISHED / "mine").mkdir(parents=True)
    (home / PUBLISHED / "mine" / "mine.csv").write_text("1")
    assert "mine/mine.csv is published, and nothing makes it" in refused("publish", "--check")


def test_extras_are_published_by_name(current, home, organbench, refused, monkeypatch):
    monkeypatch.chdir(home)
    words = ("publish", "silicone", "--results", current)
    assert f"{current / 'silicone'} is missing; run `python -m studies.tools.silicone.main` first" in refused(*words)
    (current / "silicone").mkdir()
    (current / "silicone" / "silicone.csv").write_text("new")
    assert "silicone was made by other code" in refused(*words)
    set_stamp(current, "silicone")
    (home / PUBLISHED / "silicone").mkdir(parents=True)
    (home / PUBLISHED / "silicone" / "older.png").write_text("old")
    findings = Sentences("README.md", "findings", ("silicone",), lambda published: ["made of silicone"])
    monkeypatch.setattr(publishing, "SENTENCES", (findings,))
    begin, end = findings.marks
    (home / "README.md").write_text(f"# Title\n{begin}\nold\n{end}\n")
    assert organbench(*words)[0] == 0
    assert (home / "README.md").read_text() == f"# Title\n{begin}\n- made of silicone\n{end}\n"
    assert [file.name for file in (home / PUBLISHED / "silicone").iterdir()] == ["silicone.csv"]
