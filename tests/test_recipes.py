"""Every recipe of CONTRIBUTING is followed: its example joins its tuple and is held to the contract of its kind."""

import importlib.util
import inspect
import itertools
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import massspring
from massspring import METHODS, Volumes, tetrahedral_body
from massspring.body.laws import LAWS
from massspring.sources import OWN
from studies.catalog import STUDIES, Chart
from studies.catalog.methods import contestants
from studies.geometry.organs import SHAPES
from studies.geometry.surface.first_surface import first_surface
from studies.lab.methods_page import methods_page
from studies.metrics.metrics import METRICS
from studies.runs.case import Case, case_from_json
from studies.runs.recipes import TetrahedralBody
from studies.runs.run import measure
from studies.scene.library import JUDGED, SCENES
from studies.store.record import Status
from studies.sweep.find_study import find_studies
from studies.sweep.load import load_runs
from studies.sweep.run_studies import run_studies
from tests.massspring import rows
from tests.massspring.body import test_laws
from tests.massspring.conftest import SOFT, ball_body, block, block_body, body_of, hollow_body  # noqa: F401
from tests.massspring.methods import test_capabilities, test_methods
from tests.studies.catalog import test_catalog
from tests.studies.geometry.organs import test_shapes
from tests.studies.metrics import test_metric
from tests.studies.plots import test_contract
from tests.studies.scene import test_library
from tests.studies.tiny import Silent
from tests.test_docs import code

KINDS = ("metric", "scene", "method", "study", "chart", "organ", "stiffness law")
"""What CONTRIBUTING.md has a recipe for."""


def title(kind: str) -> str:
    return f"Add {'an' if kind[0] in 'aeiou' else 'a'} {kind}"


@pytest.fixture
def recipe(tmp_path, monkeypatch):
    """The module that a recipe makes, in a file of its own, as when it is followed."""

    def followed(kind: str):
        name = f"recipe_{kind.replace(' ', '_')}"
        path = tmp_path / f"{name}.py"
        path.write_text(code("CONTRIBUTING.md", title(kind)), encoding="utf-8")
        spec = importlib.util.spec_from_file_location(name, path)
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, name, module)
        spec.loader.exec_module(module)
        return module

    return followed


@pytest.fixture
def add(monkeypatch):
    """Adds a thing to a tuple, wherever the tuple has been imported."""

    def added(tuple_of_things: tuple, thing) -> None:
        for module in list(sys.modules.values()):
            if str(getattr(module, "__name__", "")).startswith(("massspring", "studies", "tests")):
                for name, value in list(vars(module).items()):
                    if value is tuple_of_things and name.isupper():
                        monkeypatch.setattr(module, name, (*tuple_of_things, thing))

    return added


def hold(module, thing: str, slow: bool = False, **choices) -> int:
    """Calls the tests of a contract that take `thing`, with every value of what else they take; how many tests.

    `choices`: parameter -> its values. A test that takes a parameter without choices is an error, so that none is lost.
    """
    count = 0
    for name, test in inspect.getmembers(module, inspect.isfunction):
        wants = inspect.signature(test).parameters
        marks = {mark.name for mark in getattr(test, "pytestmark", [])}
        if not name.startswith("test_") or thing not in wants or "campaign" in marks or ("slow" in marks) != slow:
            continue
        missing = set(wants) - set(choices)
        assert not missing, f"{module.__name__}.{name} takes {', '.join(missing)}"
        for values in itertools.product(*(choices[parameter] for parameter in wants)):
            test(*values)
        count += 1
    return count


def test_every_recipe_is_tested_here():
    text = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    assert {title(kind) for kind in KINDS} == set(re.findall(r"^## (Add .*)$", text, re.M))


def test_an_added_metric_keeps_the_contract(recipe, add):
    added = recipe("metric").ADDED
    add(METRICS, added)
    status = [Status.DIVERGED, Status.TIMED_OUT, Status.FAILED, Status.NOT_CONVERGED]
    assert hold(test_metric, "entry", entry=[added], status=status) == 4
    test_metric.test_names_are_unique_and_studies_use_known_ones()
    assert test_metric.metric("volume_mean") is added


def test_a_metric_of_a_new_quantity_has_a_floor_to_be_tested_with(recipe, add):
    add(METRICS, replace(recipe("metric").ADDED, quantity="curvature"))
    assert "curvature" in test_metric.run().reference.total_uncertainty


def test_an_added_scene_keeps_the_contract(recipe, add):
    scene = recipe("scene").ADDED
    add(SCENES, scene)
    assert hold(test_library, "scene", scene=[scene], kind=("tetrahedral", "surface")) >= 7
    assert scene not in JUDGED
    record = measure(Case(scene, TetrahedralBody(nodes=100), frames=10))
    # So few nodes fold under their weight.
    assert record.status in (Status.OK, Status.FOLDED, Status.INVERTED), record.message
    weight = scene.tissue.density * record.attributes["rest_volume"] * 9.81
    assert record.fields["contact_force"].values[-1].sum(axis=0)[2] == pytest.approx(weight, rel=0.02)


@pytest.fixture
def method(recipe, add, monkeypatch):
    """The added method: in METHODS, among the rows of the tests, and where it would be imported."""
    kind = recipe("method").Added
    add(METHODS, kind)
    monkeypatch.setitem(rows.CONTESTANTS, kind.name, kind())
    monkeypatch.setattr(massspring.methods, kind.__name__, kind, raising=False)
    yield kind()
    vars(massspring).pop(kind.__name__, None)


def test_an_added_method_is_found_everywhere(method):
    assert massspring.Added is type(method) and "Added" in massspring.__all__
    assert method in contestants()
    assert "| added |" in methods_page()
    case = Case(SCENES[0], method=method)
    assert case_from_json(case.key) == case
    test_methods.test_settings_survive_json(method)


@pytest.fixture
def repository(tmp_path) -> Path:
    """A copy of the packages and of pyproject.toml, to which a user adds."""
    root = Path(__file__).parents[1]
    for package in OWN:
        shutil.copytree(root / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(root / "pyproject.toml", tmp_path)
    return tmp_path


def run_in(repository: Path, *words: str) -> str:
    """The output of a Python program that takes the packages from there."""
    environment = {**os.environ, "PYTHONPATH": str(repository)}
    done = subprocess.run([sys.executable, *words], cwd=repository, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_a_new_method_is_a_file_and_a_line_and_nothing_else(repository):
    """As a user of the repository adds one: the contracts of the imports hold, and it is listed."""
    (repository / "massspring/methods/added.py").write_text(code("CONTRIBUTING.md", title("method")), encoding="utf-8")
    registry = repository / "massspring/methods/__init__.py"
    text = registry.read_text(encoding="utf-8").replace("    Free,\n", "    Free,\n    Added,\n", 1)
    imports = "from massspring.methods.added import Added\nfrom massspring.methods.barycentre"
    registry.write_text(text.replace("from massspring.methods.barycentre", imports, 1), encoding="utf-8")
    assert " 0 broken" in run_in(repository, "-c", "from importlinter.cli import lint_imports_command as c; c()")
    assert re.search(r"^ +added +One division", run_in(repository, "-m", "studies", "list", "methods"), re.MULTILINE)


@pytest.mark.slow
def test_an_added_method_keeps_the_contract(method, request):
    """Its claims are measured, on every kind of body that its capabilities name."""
    bodies = [body_of(kind, request) for kind in rows.kinds_of(method)]
    assert len(bodies) == 2
    assert hold(test_methods, "method", method=[method], kept_body=bodies) == 9
    boast = type("Boast", (type(method),), {"volume_tol": 1e-5})  # 2.7e-5 measured
    assert not test_methods.volume_claim_holds(boast(), bodies[0])


@pytest.mark.slow
def test_an_added_method_supports_what_its_table_says(method, request):
    for kind in test_capabilities.REFUSED:
        body = test_capabilities.body_of_any(kind, request)
        test_capabilities.test_a_body_runs_or_is_refused_with_the_sentence_of_the_table(method, kind, body)
    for option in test_capabilities.REQUESTS:
        test_capabilities.test_an_option_runs_or_is_refused_with_the_sentence_of_the_table(method, option, request)
    test_capabilities.test_every_method_supports_friction(method, request)


def test_an_added_study_keeps_the_contract(recipe, add):
    study = replace(recipe("study").STUDY, main=True)
    add(STUDIES, study)
    assert hold(test_catalog, "study", study=[study]) >= 6
    test_catalog.test_names_can_be_folders_and_are_unique()
    test_metric.test_names_are_unique_and_studies_use_known_ones()
    assert study in find_studies([]) and study in find_studies(["main"]) and find_studies(["node_count"]) == [study]
    assert set(test_contract.good_runs((study,))) <= set(test_contract.GOOD)


@pytest.mark.slow
def test_an_added_study_runs_and_goes_on_where_it_was(recipe, tmp_path):
    study = recipe("study").STUDY
    assert hold(test_catalog, "case", slow=True, case=list(study.cases)) == 1
    study = replace(study, cases=tuple(replace(c, scene=replace(c.scene, reference=None)) for c in study.cases))
    assert run_studies(tmp_path, [study], 1, Silent()) == 2
    assert run_studies(tmp_path, [study], 1, Silent()) == 0
    runs, remarks = load_runs(tmp_path, study)
    assert len(runs) == 2 and not remarks


def test_an_added_chart_keeps_the_contract(recipe, monkeypatch, tmp_path):
    chart = recipe("chart")
    study = replace(recipe("study").STUDY, charts=(Chart("added.png", chart.draw),))
    (entry,) = test_contract.good_runs((study,)).items()
    assert entry[0] is chart
    monkeypatch.setitem(test_contract.GOOD, *entry)
    odd = list(test_contract.ODD)
    assert hold(test_contract, "chart", chart=[chart], runs=odd, tmp_path=[tmp_path]) == 7


def test_an_added_organ_keeps_the_contract(recipe, monkeypatch):
    make = recipe("organ").egg_shape
    monkeypatch.setitem(SHAPES, "egg", make)
    fine = {"egg": first_surface(replace(make(), cell=4 * test_shapes.MM))}
    assert hold(test_shapes, "name", name=["egg"], fine=[fine]) == 4


def test_an_added_law_keeps_the_contract(recipe, add):
    law = recipe("stiffness law").ADDED
    add(LAWS, law)
    assert hold(test_laws, "law", law=["bars"]) == 3
    assert TetrahedralBody(law="bars").law == "bars"
    body = tetrahedral_body(*block((2, 2, 2)), SOFT, "bars")
    assert body.law == "bars" and body.keeping(Volumes.nodal(body)).kept.count == body.node_count
