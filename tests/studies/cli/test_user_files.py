"""A FILE.py with STUDY, with SCENE, or with both: every command that takes a study or a scene takes it."""

import glob
import json
import re
import shlex
import zipfile
from html import unescape
from pathlib import Path

import pytest

from studies.catalog.study import Study, command_line
from studies.runs import user_code
from studies.store.paths import record_files
from studies.sweep.find_scene import find_scene
from studies.sweep.find_study import find_study
from tests.studies.tiny import tiny_study
from tests.test_docs import code

TOP = "from dataclasses import replace\nfrom tests.studies.tiny import *\n"
SCENE = "SCENE = replace(SQUEEZE, name='alone')\n"
STUDY = "STUDY = tiny_study(cases=(tiny_case(recorded=('surface',)),))\n"
SEVERAL = "STUDY = tiny_study(cases=(tiny_case(), tiny_case(scene=replace(SQUEEZE, name='other'))))\n"


@pytest.fixture
def write(tmp_path):
    def written(*parts, name="mine.py"):
        path = tmp_path / name
        path.write_text("".join((TOP, *parts)))
        return str(path)

    return written


@pytest.mark.parametrize(
    "words", [("run", "--dry-run"), ("show",), ("advise", "--no-timing"), ("safe-dt", "--nodes", 60)]
)
def test_both_kinds_of_file_are_taken(organbench, write, tmp_path, monkeypatch, words):
    monkeypatch.setenv("ORGANBENCH_RESULTS", str(tmp_path))
    command, *options = words
    for part in (SCENE, STUDY):
        _, out, err = organbench(command, write(part), *options)
        assert out or "no results of the study 'accuracy'" in err, err


def test_the_example_of_contributing_is_a_scene_for_other_programs(organbench, tmp_path):
    """The example of a study has STUDY alone, that of an own file both."""
    for section, name in (("Add a study", "ball_squeeze"), ("Keep it in a file of your own", "ball_on_the_moon")):
        user_code.forget()
        path = tmp_path / "example.py"
        path.write_text(code("CONTRIBUTING.md", section))
        assert find_scene(str(path)).name == name
    user_code.forget()


def test_lines_for_a_shell_name_the_file(write):
    study = find_study(write(STUDY))
    path = study.word
    assert command_line("run", [study], "--case", "a b") == f"organbench run {shlex.quote(path)} --case 'a b'"
    assert command_line("run", [study], elsewhere=True) == "organbench run mine.py"
    there = Study("population-meshes", "", (), (), (), word="population@/home/someone/meshes:mm")
    assert command_line("report", [there, tiny_study()], elsewhere=True) == (
        "organbench report population@meshes:mm tiny"
    )


def test_do_it_again_is_a_line_that_runs_and_reports_keep_studies_of_files(organbench, write, tmp_path, monkeypatch):
    """The page without the file holds what was drawn with it; its lines name the file, which is not run for it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("studies.cli.commands.report.STUDIES", ())
    write(STUDY)
    assert organbench("run", "mine.py", "--jobs", 1)[0] == 0
    assert organbench("report", "mine.py")[0] == 0
    page = tmp_path / "results" / "report.html"
    first = unescape(page.read_text())
    (tmp_path / "mine.py").rename(tmp_path / "hidden.py")
    page.unlink()
    code, out, _ = organbench("report")
    assert code == 0 and "report.html" in out
    again = unescape(page.read_text())
    case = find_study("hidden.py").cases[0].name
    for shown in (first, again):
        assert f"organbench run mine.py --case {case}" in shown
        assert "<code>organbench run mine.py</code><br><code>organbench report mine.py</code>" in shown
    (tmp_path / "hidden.py").rename(tmp_path / "mine.py")
    assert organbench(*shlex.split(f"run mine.py --case {case}"))[0] == 0


def test_stored_cases_of_a_file_are_viewed_and_archived(organbench, write, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(STUDY)
    assert "run `organbench run mine.py` first" in organbench("archive", "mine.py", "--results", "none")[2]
    assert organbench("run", "mine.py", "--jobs", 1)[0] == 0
    code, out, err = organbench("view", "mine.py", "-o", "seen.vtkhdf")
    assert code == 0 and out.startswith("seen.vtkhdf: 1 body"), err
    assert "nothing of 'alone' is stored in results" in organbench("view", write(SCENE, name="other.py"))[2]
    code, out, err = organbench("archive", "mine.py", "-o", "all.zip")
    assert code == 0, err
    with zipfile.ZipFile("all.zip") as packed:
        assert "organbench report mine.py --results ." in packed.read("README.md").decode()
        assert "mine.py" in packed.namelist()


def test_a_case_is_named_by_a_part_of_its_name(organbench, refused, write, tmp_path):
    path, results = write("STUDY = tiny_study()\n"), tmp_path / "results"
    assert organbench("run", path, "--case", "free", "--results", results, "--jobs", 1)[0] == 0
    (record,) = record_files(results, "tiny")
    assert "-free-" in record.name
    several = refused("run", path, "--case", "tetrahedral", "--results", results)
    names = [case.name for case in tiny_study().cases]
    assert f"3 cases of tiny have 'tetrahedral' in their name: {', '.join(names)}; give more of it" in several
    assert organbench("run", path, "--case", names[0], "--dry-run", "--results", results)[0] == 0
    assert f"did you mean {names[0]!r}" in refused("run", path, "--case", names[0] + "x", "--results", results)


def test_a_study_that_the_page_cannot_show_is_named(organbench, write, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("studies.cli.commands.report.STUDIES", ())
    write(STUDY)
    assert organbench("run", "mine.py", "--jobs", 1)[0] == 0
    part = tmp_path / "results" / "cache" / "tiny.page.json"
    kept = json.loads(part.read_text().split("\n", 1)[1])
    assert kept["study"]["word"] == "mine.py"
    for record in (tmp_path / "results" / "tiny").glob("tiny_squeeze*.h5"):
        record.touch()
    err = organbench("report")[2]
    assert "tiny shows its last charts; `organbench report mine.py` redraws them" in err
    for damage in (lambda: part.write_text(json.dumps(kept)), part.unlink):
        damage()
        err = organbench("report")[2]
        assert (
            "tiny is not on the page; `organbench report FILE.py`, with the file that defines the study, adds it" in err
        )


PAGE = Path(__file__).parents[3] / "docs" / "first-study.md"
PART = re.compile(
    r"```(?P<kind>python|text)\n(?P<block>.*?)```|^    organbench (?P<command>[^\n]*)$|"
    r"Change `(?P<old>[^`]+)` to `(?P<new>[^`]+)`",
    re.DOTALL | re.MULTILINE,
)


@pytest.mark.campaign
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_the_tutorial_is_followed(organbench, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    file, printed, count = tmp_path / "first.py", "", 0
    for part in re.finditer(PART, PAGE.read_text(encoding="utf-8")):
        if part["command"]:
            words = [word for text in shlex.split(part["command"]) for word in glob.glob(text) or [text]]
            code, out, err = organbench(*words)
            assert code == 0, f"organbench {part['command']}: {out}{err}"
            printed += out + err
        elif part["old"]:
            assert file.read_text().count(part["old"]) == 1
            file.write_text(file.read_text().replace(part["old"], part["new"]))
        elif part["kind"] == "text":
            for line in part["block"].splitlines():
                assert line.rstrip() in printed, f"not printed: {line}"
            printed, count = "", count + 1
        elif file.exists():
            first, rest = file.read_text().split("CHARTS", 1)
            file.write_text(f"{first}{part['block']}CHARTS{rest}")
        else:
            file.write_text(part["block"])
    assert count == 5 and (tmp_path / "results" / "first" / "volume.png").is_file()
