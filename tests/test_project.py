"""What the project promises about itself: pinned versions, who imports whom, the list of make targets."""

import ast
import re
import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from studies.catalog import STUDIES
from studies.sweep.find_study import find_studies

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
PINS = {
    canonicalize_name(name): version
    for name, version in re.findall(r"^([\w.-]+)==(\S+)$", (ROOT / "constraints.txt").read_text(), re.MULTILINE)
}


def requirements() -> list[Requirement]:
    extras = PROJECT["optional-dependencies"]
    texts = PROJECT["dependencies"] + [text for name in extras for text in extras[name]]
    return [r for r in map(Requirement, texts) if r.name != PROJECT["name"]]


def test_the_constraints_hold_nothing_but_pins():
    lines = [line for line in (ROOT / "constraints.txt").read_text().splitlines() if not line.startswith("#")]
    assert len(lines) == len(PINS)


@pytest.mark.parametrize("requirement", requirements(), ids=lambda r: r.name)
def test_each_requirement_is_pinned_within_its_range(requirement):
    assert requirement.specifier.contains(PINS[canonicalize_name(requirement.name)])


def test_what_the_requirements_require_is_pinned_too():
    open_ends, visited = requirements(), set()
    while open_ends:
        requirement = open_ends.pop()
        extra = next(iter(requirement.extras), "")
        name = canonicalize_name(requirement.name)
        if (name, extra) in visited or (requirement.marker and not requirement.marker.evaluate({"extra": ""})):
            continue
        visited.add((name, extra))
        assert name in PINS, f"{name} is installed unpinned"
        try:
            needs = map(Requirement, requires(name) or [])
        except PackageNotFoundError:  # an extra that is not installed here
            continue
        open_ends += [r for r in needs if r.marker is None or r.marker.evaluate({"extra": extra})]
    assert len(visited) > 20


@pytest.mark.parametrize(
    ("package", "allowed"),
    [
        # llvmlite is numba's own back end and comes with it; the clock inside a compiled loop is written in it.
        ("massspring", {"massspring", "numpy", "scipy", "numba", "llvmlite"}),
        # Of massspring only where compiled code is kept, and that in one file (the import contracts).
        (
            "reference_fem",
            {"reference_fem", "numpy", "scipy", "numba", "skfem", "pypardiso", "massspring"},
        ),
    ],
)
def test_the_solvers_import_little(package, allowed):
    files = sorted((ROOT / package).rglob("*.py"))
    assert files
    for file in files:
        for node in ast.walk(ast.parse(file.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module else []
            foreign = {name.split(".")[0] for name in names} - allowed - {"lazy_loader"} - sys.stdlib_module_names
            assert not foreign, f"{file.relative_to(ROOT)} imports {foreign}"


def test_make_alone_lists_the_targets():
    text = subprocess.run(["make", "-s"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for target in (
        "study",
        "study-%",
        "smoke",
        "test",
        "check",
        "docs",
        "links",
        "figures",
        "speeds",
        "clean",
        "results/%.png",
    ):
        assert re.search(rf"^  {re.escape(target)} +\S", text, re.MULTILINE), target


@pytest.mark.parametrize(("old", "new"), [("stress", "fuzz"), ("bench", "speeds")])
def test_an_old_target_is_refused_with_its_new_name(old, new):
    done = subprocess.run(["make", "-s", old], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stderr.startswith(f"make {old} is now make {new}\n")


@pytest.mark.parametrize(("goals", "fast", "all_of_them"), [("check", 1, 0), ("test", 0, 1), ("check test", 0, 1)])
def test_tests_run_once_also_where_check_and_test_are_asked_for(goals, fast, all_of_them):
    command = ["make", "--dry-run", "--silent", *goals.split()]
    lines = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    runs = [line for line in lines if "pytest" in line]
    assert [sum("not slow" in line for line in runs), sum("not slow" not in line for line in runs)] == [
        fast,
        all_of_them,
    ]
    assert any("ruff check" in line for line in lines) == ("check" in goals)
    assert any("docs/site/build.py --links" in line for line in lines) == ("check" in goals)
    assert all("not campaign and not lab" in line for line in runs)


def test_make_names_no_study_and_lists_those_that_say_they_are_main():
    makefile = (ROOT / "Makefile").read_text()
    assert [study.name for study in STUDIES if re.search(rf"run\b.* {study.name}\b", makefile)] == []
    text = subprocess.run(["make", "-s"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    (listed,) = re.findall(r"^Main studies: (.*)$", text, re.MULTILINE)
    assert sorted(listed.split()) == sorted(study.name for study in find_studies([])) != []


def test_campaigns_run_in_verify():
    command = ["make", "--dry-run", "--silent", "verify"]
    lines = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    assert any(line.endswith("python -m studies.lab.verify") for line in lines)
    assert any(re.search(r"pytest .* -m .campaign or lab.$", line) for line in lines)
