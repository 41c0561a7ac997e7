"""The list of commands and the list of names agree with the code, without loading it."""

import pkgutil
from collections import Counter

import pytest
from typer.testing import CliRunner

from massspring import LITERATURE, METHODS
from studies.catalog import STUDIES
from studies.catalog.population import Population, population_study
from studies.cli import app as cli
from studies.cli import commands, outline
from studies.cli.commands.list import KINDS
from studies.cli.commands_page import PAGE, commands_page
from studies.cli.loading import COMMANDS, NAMES, loaded
from studies.metrics.metrics import METRICS


def test_the_outline_is_what_the_modules_say():
    shown = (*STUDIES, population_study((Population("liver", 1),)))
    assert outline.studies() == [(s.name, paragraph(s.question)) for s in shown]
    assert outline.methods() == [(m.name, paragraph(m.__doc__)) for m in (*METHODS, *LITERATURE)]
    assert outline.metrics() == [(m.name, paragraph(m.of.__doc__)) for m in METRICS]


def paragraph(text):
    """The first one, whole, however many lines it takes."""
    return " ".join((text or "").split("\n\n")[0].split())


@pytest.mark.parametrize("name", COMMANDS)
def test_the_line_of_a_command_begins_its_help(name):
    line = COMMANDS[name].line
    assert (loaded(name).help or "").startswith(line.removesuffix("."))
    assert len(line) <= 64, "at 80 columns it takes one line"


def test_no_group_of_the_list_of_commands_is_long():
    sizes = Counter(entry.panel for entry in COMMANDS.values())
    assert max(sizes.values()) <= 7
    assert [entry.panel for entry in COMMANDS.values()] == list(sizes.elements()), "group by group"
    shown = CliRunner().invoke(cli.app, ["--help"], env={"COLUMNS": "80"}).output
    assert [panel for panel in sizes if f"─ {panel} ─" not in shown] == []


def test_every_module_of_a_command_is_listed():
    modules = {name for _, name, _ in pkgutil.iter_modules(commands.__path__)}
    assert {name.replace("-", "_") for name in COMMANDS} == modules


def test_the_page_of_commands_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == commands_page(), "run python -m studies.cli.commands_page"


@pytest.mark.parametrize(("old", "new"), [("check", "mesh-check"), ("stress", "fuzz"), ("cost", "profile")])
def test_an_old_command_is_refused_with_its_new_name(refused, old, new):
    assert f"the command '{old}' is now '{new}': run `organbench {new}`" in refused(old, "--help")
    assert old not in COMMANDS and new in COMMANDS


def test_a_misspelt_command_is_one_sentence_and_names_the_nearest(refused):
    assert "unknown command 'stauts'; did you mean 'status'" in refused("stauts")


def test_list_takes_a_kind(organbench, refused):
    assert NAMES["kinds"]() == list(KINDS)
    code, out, _ = organbench("list", "scenes")
    assert code == 0 and "ball_squeeze" in out and "volume_loss" not in out
    assert "unknown kind of name 'scene'; did you mean 'scenes'" in refused("list", "scene")
