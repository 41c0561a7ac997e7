"""The command line: words in, tables and charts out."""

import os
import pkgutil
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from massspring import METHODS
from studies.catalog import STUDIES
from studies.cli import app as cli
from studies.cli import commands
from studies.cli.commands.show import SHOWN
from studies.cli.groups import FORMER, GROUPS
from studies.geometry.organs import SHAPES
from studies.metrics.metrics import METRICS
from studies.metrics.table import study_table
from studies.reference.reference_solves import reference_solves
from studies.runs.current import case_path
from studies.scene.library import CUT, SCENES
from studies.store.record import Field, read_record, write_record
from studies.sweep.load import load_runs
from tests.campaigns import campaign
from tests.studies.tiny import content, diverging_case, tiny_case, tiny_study

SHAPE = "the body at rest does not keep the shape of its organ"
"""Of bodies as coarse as those of tests."""


def test_list_names_everything():
    result = CliRunner().invoke(cli.app, ["list"], env={"COLUMNS": "200"})
    assert result.exit_code == 0
    named = result.stdout.split()
    for entry in (*STUDIES, *SCENES, *CUT, *METHODS, *METRICS):
        assert entry.name in named
    assert set(SHAPES) <= set(named)


def test_help_comes_without_words():
    result = CliRunner().invoke(cli.app, [])
    commands = ("list", "run", "show", "table", "report", "replay", "safe-dt")
    assert all(command in result.output for command in commands)


@pytest.mark.slow
def test_run_a_file_from_nothing(organbench, tiny_file, tmp_path):
    code, out, err = organbench("run", tiny_file, "--results", tmp_path / "results", "--jobs", 1)
    assert code == 0
    assert f"tiny: 3 cases, 2 timings ran, charts in {tmp_path / 'results' / 'tiny'}" in out
    assert out.splitlines()[-1] == "tiny: 3 cases: 2 ok, 1 diverged"
    assert (tmp_path / "results" / "tiny" / "picture.txt").read_text() == "3 runs"
    assert [line for line in err.splitlines() if SHAPE not in line] == []  # the case that diverges is there on purpose
    again, out, err = organbench("run", tiny_file, "--results", tmp_path / "results")
    assert (again, err) == (0, "")
    assert "tiny: nothing ran" in out


@pytest.mark.slow
def test_a_smoke_run_is_kept_apart(organbench, tiny_file, results):
    before = content(results)
    code, out, _ = organbench("run", tiny_file, "--smoke", "--results", results, "--jobs", 1)
    assert code == 0
    assert str(results / "smoke" / "tiny") in out
    assert "3 cases: 2 ok, 1 diverged" in organbench("show", tiny_file, "--results", results, "--smoke")[1]
    after = content(results)
    assert before.items() <= after.items()
    assert all(path.parts[0] == "smoke" for path in after.keys() - before.keys())


def test_a_run_and_its_report_are_one_command(organbench, tiny_file, results, monkeypatch):
    """Of this study alone: the references of all others take long to read."""
    monkeypatch.setattr("studies.cli.commands.run.STUDIES", ())
    (results / "report.html").unlink(missing_ok=True)
    code, out, _ = organbench("run", tiny_file, "--results", results, "--report")
    assert code == 0 and out.splitlines()[-1] == str(results / "report.html")
    assert "tiny: nothing ran" in out and (results / "report.html").is_file()


def test_status_counts_and_says_why(organbench, tiny_file, results):
    path = case_path(results, "tiny", tiny_case())
    write_record(path, replace(read_record(path), fingerprint="0"))
    code, out, _ = organbench("show", tiny_file, "--results", results)
    assert code == 0
    first, *why = out.splitlines()
    assert first == "tiny: 3 cases: 1 ok, 1 diverged, 1 stale"
    stale = next(k for k, line in enumerate(why) if line.startswith("  stale: ") and "changed" in line)
    assert why[stale + 1] == f"    {tiny_case().name}"
    diverged = next(k for k, line in enumerate(why) if line.startswith("  diverged: "))
    assert why[diverged + 1] == f"    {diverging_case().name}"


def test_status_names_some_of_many_and_all_with_an_option(organbench, tmp_path):
    code, out, _ = organbench("show", "volume_loss", "--results", tmp_path)
    (rest,) = (int(line.split()[1]) for line in out.splitlines() if "more (--all names them)" in line)
    assert code == 0
    assert len(named(out)) == SHOWN
    code, out, _ = organbench("show", "volume_loss", "--all", "--results", tmp_path)
    assert len(named(out)) == SHOWN + rest
    assert "ball_squeeze-surface-550-free-dt0.5" in out


def named(out) -> list[str]:
    return [line for line in out.splitlines() if line.startswith("    ") and "--all" not in line]


def test_status_of_everything(organbench, tmp_path):
    code, out, _ = organbench("show", "--results", tmp_path)
    assert code == 0
    counts, references = out.split("references:\n")
    assert [line.split(":")[0] for line in counts.splitlines()] == [study.name for study in STUDIES]
    head, *rows = references.splitlines()
    assert head.split() == ["scene", "unknowns", "seconds", "state"]
    assert len(rows) == len({scene.name for study in STUDIES for scene in study.scenes if reference_solves(scene)})
    assert all(row.split()[-1] == "missing" for row in rows)
    assert all("missing" in line for line in counts.splitlines())


def test_show_tells_units_status_and_numbers(organbench, results):
    path = case_path(results, "tiny", diverging_case())
    code, out, _ = organbench("show", path)
    assert code == 0
    assert re.search(r" dt = [0-9.e-]+ s\b", out) and re.search(r"rest_volume = [0-9.e-]+ m\^3", out)
    assert re.search(r"\bsteps = \d+ *(\w+ =.*)?$", out, re.MULTILINE), "a count has no unit"
    for word in ("status diverged", "dt_limit = ", "seconds = ", "volume", "m^3", "not finite: ", "code "):
        assert word in out
    code, whole, _ = organbench("show", path, "--all")
    assert code == 0
    for word in ("volume: enclosed volume", "beyond_limit"):
        assert word in whole and word not in out


def test_table_on_screen_and_as_csv(organbench, tiny_file, results, tmp_path):
    code, out, err = organbench("table", tiny_file, "--results", results)
    assert (code, err) == (0, "")
    assert out.splitlines()[0] == "law van_gelder, 60 nodes, stiffness 1"
    assert ["worst", "time"] in [line.split() for line in out.splitlines()]
    assert "[%]" in out and out.count("[%]") == 1
    assert "implicit_volume" in out
    target = tmp_path / "new" / "table [draft].csv"
    code, out, _ = organbench("table", tiny_file, "--results", results, "--csv", target)
    assert (code, out.strip()) == (0, str(target))
    table = pd.read_csv(target)
    assert table["status"].tolist() == ["ok", "ok", "diverged"]
    kept, free, lost = table["volume_worst [%]"]
    assert 0 <= kept < free
    assert np.isnan(lost)
    assert table["step_time [µs]"].notna().tolist() == [True, True, False]


def test_table_as_parquet_keeps_digits_and_types(organbench, tiny_file, results, tmp_path):
    pytest.importorskip("pyarrow", reason="the extra parquet is not installed")
    target = tmp_path / "new" / "table.parquet"
    code, out, _ = organbench("table", tiny_file, "--results", results, "--parquet", target)
    assert (code, out.strip()) == (0, str(target))
    stored, expected = pd.read_parquet(target), study_table(load_runs(results, tiny_study())[0], tiny_study().columns)
    pd.testing.assert_frame_equal(stored, expected, check_exact=True)
    assert stored["nodes"].dtype == np.int64 and stored["volume_worst [%]"].dtype == np.float64


def test_parquet_without_its_package_is_one_sentence(refused, tiny_file, results, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    sentence = refused("table", tiny_file, "--results", results, "--parquet", tmp_path / "t.parquet")
    assert "needs the package pyarrow" in sentence and not (tmp_path / "t.parquet").exists()


def test_table_of_chosen_metrics(organbench, tiny_file, results):
    code, out, _ = organbench("table", tiny_file, "--results", results, "--metrics", "min_j, real_time")
    assert code == 0
    assert ["min", "real"] in [line.split() for line in out.splitlines()]
    assert "worst" not in out


def test_report_names_what_it_drew(organbench, tiny_file, results):
    code, out, _ = organbench("report", tiny_file, "--results", results)
    names = ("tiny/picture.txt", "tiny/tiny.csv", "report.html")
    assert (code, out.split()) == (0, [str(results / name) for name in names])
    assert (results / "tiny" / "picture.txt").read_text() == "3 runs"


def test_replay_and_its_exit_code(organbench, results):
    path = case_path(results, "tiny", tiny_case())
    code, out, _ = organbench("replay", path)
    assert (code, out.strip()) == (0, f"{tiny_case().name}: the same, bit for bit (ok)")
    record = read_record(path)
    pressure = record.fields["pressure"]
    fields = record.fields | {"pressure": Field(pressure.values + 1.0, pressure.unit, pressure.description)}
    write_record(path, replace(record, fields=fields, fingerprint="0", machine="00000000"))
    code, out, _ = organbench("replay", path)
    assert code == 1
    assert "'pressure' differs by up to 1 Pa" in out
    assert "the code has changed" in out
    assert "another machine" in out


def test_safe_dt_predicts_and_verifies(organbench):
    code, out, err = organbench("safe-dt", "ball_squeeze", "--nodes", 60)
    assert code == 0
    assert SHAPE in err
    assert "stability limit" in out
    assert "of the limit): diverged" in out
    assert re.search(r"bracket +stable at [\d.]+ ms, diverges at [\d.]+ ms", out)
    assert out.strip().endswith("verified")
    assert "not verified" not in out


LINES = {command.name for command in cli.app.registered_commands if not command.hidden}
ROOT = Path(__file__).parents[3]


def test_every_module_of_a_command_is_listed_in_a_short_group():
    modules = {name for _, name, _ in pkgutil.iter_modules(commands.__path__)}
    assert {name.replace("-", "_") for name in LINES} == modules
    assert max(map(len, GROUPS.values())) <= 7
    shown = CliRunner().invoke(cli.app, [], env={"COLUMNS": "80"}).output
    assert [group for group in GROUPS if f"─ {group} ─" not in shown] == []
    assert [name for name in LINES if not re.search(rf"^│ {name} +[A-Z]", shown, re.M)] == []


@pytest.mark.parametrize("name", FORMER)
def test_a_former_command_is_refused_with_what_replaced_it(refused, name):
    sentence = refused(name, "--help")
    assert f"the command '{name}' {FORMER[name]}" in sentence and name not in LINES
    named = [words.split()[1] for words in sentence.split("`")[1::2] if words.startswith("organbench ")]
    assert set(named) <= LINES


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (("run", "volume_l"), ["volume_loss"]),
        campaign(("advise", "liver_pre"), ["liver_press"]),
        (("run", "--sm"), ["--smoke"]),
        (("nothing", "prof"), ["profile"]),
    ],
    ids=" ".join,
)
def test_a_shell_is_offered_commands_names_and_options(words, offered):
    line = {"COMP_WORDS": " ".join(("organbench", *words)), "COMP_CWORD": str(len(words))}
    env = {**os.environ, **line, "_ORGANBENCH_COMPLETE": "complete_bash", "PYTHONPATH": str(ROOT)}
    program = "import sys; sys.argv = ['organbench']; from studies.__main__ import main; main()"
    done = subprocess.run([sys.executable, "-c", program], env=env, capture_output=True, text=True, check=False)
    assert (done.stdout.split(), done.stderr) == (offered, "")
