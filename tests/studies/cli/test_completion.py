"""A shell completes commands, options and names; names come without loading the command that takes them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from studies.catalog import STUDIES
from studies.catalog.population import POPULATION
from studies.cli.loading import COMMANDS, NAMES
from studies.geometry.organs import SHAPES
from studies.scene.library import CUT, SCENES
from tests.campaigns import campaign

ROOT = Path(__file__).parents[3]
PROGRAM = """
import sys
sys.argv = ["organbench"]
from studies.__main__ import main
try:
    main()
finally:
    print(*(name for name in ("numba", "scipy", "pandas", "h5py") if name in sys.modules), file=sys.stderr)
"""


def completed(*words: str) -> tuple[list[str], list[str]]:
    """What bash offers for the last of the words, and which heavy modules were loaded for it."""
    line = {"COMP_WORDS": " ".join(("organbench", *words)), "COMP_CWORD": str(len(words))}
    env = {**os.environ, **line, "_ORGANBENCH_COMPLETE": "complete_bash", "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", PROGRAM], env=env, capture_output=True, text=True, check=False)
    *errors, loaded = done.stderr.splitlines()
    assert not errors
    return done.stdout.split(), loaded.split()


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (("sta",), ["status"]),
        (("run", "vol"), ["volume_loss"]),
        (("run", "volume_loss", "vol"), []),
        (("advise", "liver_pre"), ["liver_press"]),
        (("mesh", "kid"), ["kidney"]),
        (("mesh-check", "kid"), []),
        campaign(("table", "--all", "vol"), ["volume_loss"]),
        campaign(("table", "--csv", "vol"), []),
        (("run", "--sm"), ["--smoke"]),
        (("nothing", "sta"), ["status"]),
    ],
    ids=" ".join,
)
def test_what_is_offered(words, offered):
    completions, loaded = completed(*words)
    assert completions == offered
    if not any(word.startswith("-") for word in words):
        assert loaded == []


def test_every_name_is_offered():
    assert NAMES["studies"]() == [*(study.name for study in STUDIES), POPULATION]
    assert NAMES["scenes"]() == [scene.name for scene in (*SCENES, *CUT)]
    assert NAMES["organs"]() == list(SHAPES)
    assert {entry.names for entry in COMMANDS.values()} == {*NAMES, ""}


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_for_a_shell_calls_the_program(shell):
    env = {**os.environ, "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1", "PYTHONPATH": str(ROOT)}
    words = f"['organbench', '--show-completion', '{shell}']"
    program = f"import sys; sys.argv = {words}; from studies.__main__ import main; main()"
    done = subprocess.run([sys.executable, "-c", program], env=env, capture_output=True, text=True, check=True)
    assert f"_ORGANBENCH_COMPLETE=complete_{shell}" in done.stdout
