"""Public names of a package exist, are typed, and load nothing else."""

import ast
import pickle
from importlib import import_module
from pathlib import Path

import pytest

import massspring
from massspring import LITERATURE, METHODS, Method
from studies.base.errors import StudyError
from studies.catalog import STUDIES, Chart
from studies.plots import volume_history

REPOSITORY = Path(__file__).parents[2]
FACES = ("massspring", "reference_fem", "studies", "studies.geometry")


@pytest.mark.parametrize("package", FACES)
def test_the_stub_names_what_is_there(package):
    """The stub alone says what is public: for type checkers, for `dir`, and for an import with a star."""
    module = import_module(package)
    tree = ast.parse(Path(str(module.__file__)).with_suffix(".pyi").read_bytes())
    listed = {
        alias.name: f"{package}.{node.module}"
        for node in tree.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname == alias.name  # without it a type checker takes the name for private
    }
    assert sorted(listed) == dir(module)
    methods = {method.__name__ for method in (*METHODS, *LITERATURE)}
    assert set(listed) <= set(module.__all__) <= set(listed) | methods  # a method of the tuples is public in any case
    for name, home in listed.items():
        value = getattr(module, name)
        assert value is getattr(import_module(home), name)
        if isinstance(value, type):
            assert pickle.loads(pickle.dumps(value)) is value


def test_every_method_is_exported():
    scope: dict = {}
    exec("from massspring import *", scope)
    for method in (*METHODS, *LITERATURE, Method):
        assert scope[method.__name__] is getattr(massspring, method.__name__) is method


@pytest.mark.parametrize("package", FACES)
def test_an_unknown_name_is_an_attribute_error(package):
    with pytest.raises(AttributeError, match=f"No {package} attribute Bodyy"):
        _ = import_module(package).Bodyy


def test_every_chart_of_the_catalogue_is_listed():
    for study in STUDIES:
        for chart in study.charts:
            assert chart.draw is import_module(str(chart.drawing).split(":")[0]).draw


@pytest.mark.parametrize("drawing", ["studies.plots.volumes:draw", "studies.plots.laws:paint", "draw", ""])
def test_a_chart_that_names_no_function_is_one_sentence(drawing):
    with pytest.raises(StudyError, match=r"chart a\.png: there is no function|chart 'a\.png' is drawn by"):
        _ = Chart("a.png", drawing).draw


def test_a_chart_takes_a_function_too():
    assert Chart("a.png", volume_history.draw).draw is volume_history.draw
