"""The list of commands agrees with the commands; former commands say what replaced them; a shell completes words."""

import os
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from studies.cli import app as cli
from studies.cli import commands
from studies.cli.groups import FORMER, GROUPS

LINES = {command.name for command in cli.app.registered_commands}
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
        (("prof",), ["profile"]),
        (("run", "volume_l"), ["volume_loss"]),
        (("advise", "liver_pre"), ["liver_press"]),
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
