"""The list of commands and the list of names say what the code says, without loading it."""

import pytest

from massspring import LITERATURE, METHODS
from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.cli import app as cli
from studies.cli import outline
from studies.cli.commands.results.list_names import KINDS
from studies.cli.completing import NAMES
from studies.cli.group import loaded
from studies.metrics.metrics import METRICS
from studies.population import Population, population_study


def test_the_outline_is_what_the_modules_say():
    shown = (*STUDIES, population_study((Population("liver", 1),)))
    assert outline.studies() == [(s.name, s.question.strip().split("\n")[0]) for s in shown]
    assert outline.methods() == [(m.name, (m.__doc__ or "").strip().split("\n")[0]) for m in (*METHODS, *LITERATURE)]
    assert outline.metrics() == [(m.name, m.description) for m in METRICS]


def test_a_registry_of_another_form_is_one_sentence():
    with pytest.raises(StudyError, match="there is no tuple METHODS"):
        list(outline._registered("massspring.errors", "METHODS"))
    with pytest.raises(StudyError, match="no tuple of imported names"):
        list(outline._registered("studies.metrics.metrics", "METRICS"))


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_the_line_of_a_command_begins_as_its_help(name):
    entry = cli.COMMANDS[name]
    command = loaded(name, entry)
    first = (command.help or "").split("\n")[0]
    assert first.split()[:3] == entry.help.split()[:3], (first, entry.help)
    assert len(entry.help) <= 66, "at 80 columns it takes one line"


def test_a_misspelt_command_is_one_sentence_and_names_the_nearest(refused):
    assert "unknown command 'stauts'; did you mean 'status'" in refused("stauts")


def test_list_takes_a_kind(organbench, refused):
    assert NAMES["kinds"]() == list(KINDS)
    code, out, _ = organbench("list", "scenes")
    assert code == 0 and "ball_squeeze" in out and "volume_loss" not in out
    assert "unknown kind of name 'scene'; did you mean 'scenes'" in refused("list", "scene")
