"""Commands and documents say that a stranger's FILE.py is a program."""

from pathlib import Path

import pytest

from studies.cli.terminal import PROGRAM

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("command", ["run", "table", "show", "report"])
def test_the_help_of_a_command_that_runs_a_file_says_so(organbench, monkeypatch, command):
    monkeypatch.setenv("COLUMNS", "400")
    code, out, _ = organbench(command, "--help")
    assert code == 0 and PROGRAM in " ".join(out.split())


def test_the_list_of_commands_says_so_for_all(organbench):
    assert "run only files you trust (SECURITY.md)" in " ".join(organbench("--help")[1].split())


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "docs/results.md", "docs/cluster.md"])
def test_the_pages_lead_to_what_is_promised(page):
    assert "SECURITY.md)" in (ROOT / page).read_text(encoding="utf-8")
