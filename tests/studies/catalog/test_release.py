"""`make publish`: every published folder has a step that makes it, in a working order, and it goes on when repeated."""

import re
import subprocess
from pathlib import Path

import pytest

from massspring.sources import own_file
from studies.base.errors import StudyError
from studies.cli.loading import COMMANDS
from studies.report import release
from studies.report.publish import EXTRAS, PUBLISHED
from studies.report.release import Step, check_commit, check_complete, schedule, seconds_of, steps
from studies.store.ledger import Ledger
from studies.store.stamps import set_stamp

REPOSITORY = Path(__file__).parents[3]


def test_every_published_folder_is_made_by_a_step():
    check_complete(REPOSITORY / PUBLISHED, steps())
    assert len(list((REPOSITORY / PUBLISHED).iterdir())) > 20


def test_a_folder_that_no_step_makes_is_named(tmp_path):
    (tmp_path / "league").mkdir()
    check_complete(tmp_path, steps())
    (tmp_path / "mine").mkdir()
    with pytest.raises(StudyError, match=r"no step makes .*mine; add it to EXTRAS"):
        check_complete(tmp_path, steps())


def test_each_command_is_there():
    targets = re.findall(r"^([a-z][a-z-]*%?):", (REPOSITORY / "Makefile").read_text(), re.MULTILINE)
    for step in steps():
        program, *rest = step.command.split()
        if program == "organbench":
            assert rest[0] in COMMANDS
        elif program == "make":
            assert rest[0] in targets
        else:
            assert program == "python" and rest[0] == "-m" and own_file(rest[1]) is not None
    assert {"publish", "publish-plan"} <= set(targets)


def test_what_is_published_is_made_before_and_checked_at_the_end():
    commands = [step.command for step in steps()]
    assert len(set(commands)) == len(commands)
    publishing = commands.index("organbench publish")
    makers = [commands.index(extra.command) for extra in EXTRAS.values()]
    makers += [number for number, step in enumerate(steps()) if step.study]
    assert max(makers) < publishing < commands.index("organbench publish population") < len(commands) - 1
    assert commands[-1] == "organbench publish --check"
    sweep = commands.index("python -m studies.exchange.peers.main --sweep")
    assert sweep < commands.index("make study-league")


@pytest.mark.parametrize("name", EXTRAS)
def test_each_result_without_a_study_names_the_modules_that_make_it(name):
    files = [own_file(module) for module in EXTRAS[name].makers]
    assert files and all(file is not None and file.name != "__init__.py" for file in files)


@pytest.fixture
def two_steps(monkeypatch, tmp_path):
    """A plan of two steps, whose commands are kept instead of run; the second fails if a test says so."""
    plan = [Step("python -m studies.bench.meshes", ("geometry.csv",)), Step("make bench", ("bench.csv",))]
    ran, fails = [], []

    def run(words, **_):
        ran.append(words[-1])
        if words[-1] in fails:
            return subprocess.CompletedProcess(words, 3)
        set_stamp(tmp_path, {"studies.bench.meshes": "geometry.csv", "bench": "bench.csv"}[words[-1]])
        return subprocess.CompletedProcess(words, 0)

    monkeypatch.setattr(release, "steps", lambda: plan)
    monkeypatch.setattr(release, "check_commit", lambda home: "0" * 40)
    monkeypatch.setattr(release, "check_complete", lambda published, all_steps: None)
    monkeypatch.setattr(release.crosscheck, "available", lambda: True)
    monkeypatch.setattr(release.subprocess, "run", run)
    return ran, fails


def test_it_goes_on_where_it_ended(two_steps, tmp_path, capsys):
    ran, fails = two_steps
    fails.append("bench")
    with pytest.raises(StudyError, match="`make bench` ended with exit code 3, so nothing after it was done"):
        release.main(dry=False, results=tmp_path)
    assert ran == ["studies.bench.meshes", "bench"]
    fails.clear()
    ran.clear()
    capsys.readouterr()
    release.main(dry=False, results=tmp_path)
    assert ran == ["bench"]
    assert "studies.bench.meshes (geometry.csv): current, nothing to do" in capsys.readouterr().out
    ran.clear()
    release.main(dry=False, results=tmp_path)
    assert ran == []


def test_the_plan_alone_runs_nothing_and_says_how_long(two_steps, tmp_path, capsys):
    release.main(dry=True, results=tmp_path)
    assert two_steps[0] == []
    *lines, whole = capsys.readouterr().out.splitlines()
    assert lines[1] == " 2  make bench (bench.csv): about 10 min"
    assert whole.startswith("about 0.3 h in all")  # 10 and 10 minutes


def test_a_study_takes_what_its_cases_take(tmp_path):
    (step,) = [one for one in steps() if one.study == "stability_map"]
    seconds = seconds_of(step, Ledger(tmp_path))
    assert 60.0 < seconds < 3600.0 * 24
    assert f"about {seconds / 60.0:.0f} min" in schedule([step], [seconds])[0]


def test_code_that_is_not_committed_is_refused(tmp_path):
    def git(*words):
        subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b", *words], cwd=tmp_path, check=True)

    with pytest.raises(StudyError, match="publish from a clone of the repository"):
        check_commit(tmp_path)
    git("init", "-q")
    (tmp_path / "studies").mkdir()
    (tmp_path / "studies" / "a.py").write_text("a = 1")
    (tmp_path / "README.md").write_text("old")
    git("add", ".")
    git("commit", "-qm", "first")
    commit = check_commit(tmp_path)
    (tmp_path / "README.md").write_text("what publishing writes")
    assert check_commit(tmp_path) == commit and len(commit) == 40
    (tmp_path / "studies" / "a.py").write_text("a = 2")
    with pytest.raises(StudyError, match=r"studies/a\.py is not as it was committed"):
        check_commit(tmp_path)
