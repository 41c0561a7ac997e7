"""A package like others: its version, its types, and a wheel that holds everything and nothing else."""

import inspect
import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

import massspring
import reference_fem
import studies

ROOT = Path(__file__).parents[1]
TABLES = [Path("results/published", name, f"{name}.csv") for name in ("accuracy", "population")]
"""What `organbench advise` reads in a folder without results."""
PACKAGES = (massspring, reference_fem, studies)
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_every_package_tells_the_version_of_the_distribution(organbench_version):
    assert {package.__version__ for package in PACKAGES} == {version("organbench")}
    assert organbench_version == f"organbench {version('organbench')}\n"


@pytest.fixture
def organbench_version():
    done = subprocess.run(
        [sys.executable, "-m", "studies", "--version"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return done.stdout


def test_the_version_installed_is_that_of_the_sources():
    assert version("organbench") == PROJECT["version"], "run .ci/setup again"


PROGRAM = """
import sys
import studies
from studies.__main__ import main
from studies.report.archive.packing import citation_file
print(studies.__file__)
print(citation_file())
from studies.tools.advise.answer import advise
print(advise("liver_press", timing=False).stored.where)
sys.argv = ["organbench", "list"]
main()
"""


def missing_docstrings(package) -> list[str]:
    """Public classes and functions of a package, and their public methods, that nobody describes."""
    found = []
    for name in package.__all__:
        thing = getattr(package, name)
        if not (inspect.isclass(thing) or inspect.isfunction(thing)):
            continue
        members = vars(thing).items() if inspect.isclass(thing) else ()
        own = [(f"{name}.{key}", one) for key, one in members if inspect.isfunction(one) and not key.startswith("_")]
        # A dataclass without words gets its signature as a docstring; a method may say what that of its base says.
        words = {name: thing.__doc__, **{key: inspect.getdoc(one) for key, one in own}}
        found += [key for key, said in words.items() if (said or f"{name}(").startswith(f"{name}(")]
    return found


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.__name__)
def test_every_public_name_says_what_it_is(package):
    assert missing_docstrings(package) == []


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """The wheel, built from a copy of the sources without a network."""
    source, target = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE", "CITATION.cff"):
        shutil.copy(ROOT / name, source)
    for table in TABLES:
        (source / table).parent.mkdir(parents=True)
        shutil.copy(ROOT / table, source / table)
    for package in PACKAGES:
        name = package.__name__
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    build = "from setuptools.build_meta import build_wheel; import sys; build_wheel(sys.argv[1])"
    subprocess.run([sys.executable, "-c", build, str(target)], cwd=source, capture_output=True, check=True)
    (path,) = target.glob("*.whl")
    return path


def test_the_wheel_holds_the_three_packages_whole(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    inside = {name for name in names if ".dist-info/" not in name}
    files = [file for package in PACKAGES for file in (ROOT / package.__name__).rglob("*") if file.is_file()]
    files = [file for file in files if not file.is_relative_to(ROOT / "studies" / "lab")]
    expected = {file.relative_to(ROOT).as_posix() for file in files if "__pycache__" not in file.parts}
    expected |= {f"studies/published/{table.parent.name}/{table.name}" for table in TABLES}
    assert inside == expected
    assert {f"{package.__name__}/py.typed" for package in PACKAGES} <= inside
    top = {name.split("/")[0] for name in inside}
    assert top == {"massspring", "reference_fem", "studies"}


def test_the_wheel_runs_from_another_folder(wheel, tmp_path):
    """In an environment of its own; what it requires comes from that of the tests."""
    home = tmp_path / "environment"
    venv.create(home, with_pip=False)
    place = Path(sysconfig.get_path("purelib", vars={"base": str(home), "platbase": str(home)}))
    zipfile.ZipFile(wheel).extractall(place)
    others = [folder for folder in sys.path if Path(folder).name == "site-packages"]
    (place / "others.pth").write_text("\n".join(others) + "\n")
    env = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = [str(home / "bin" / "python"), "-c", PROGRAM]
    done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    where, cited, advised, *lines = done.stdout.splitlines()
    assert where == str(place / "studies" / "__init__.py")
    assert Path(cited).is_relative_to(place) and Path(cited).read_bytes() == (ROOT / "CITATION.cff").read_bytes()
    assert advised == str(place / "studies" / "published" / "accuracy" / "accuracy.csv")
    assert any("volume_loss" in line for line in lines) and any("implicit_volume" in line for line in lines)


def test_the_wheel_installs_by_itself(wheel, tmp_path):
    """With pip and everything it requires, as a user does it."""
    home = tmp_path / "environment"
    venv.create(home, with_pip=True)
    pip = [str(home / "bin" / "python"), "-m", "pip", "install", "--quiet", "-c", str(ROOT / "constraints.txt")]
    subprocess.run([*pip, str(wheel)], check=True)
    env = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    for words in (["list"], ["--version"], ["doctor"]):
        subprocess.run([str(home / "bin" / "organbench"), *words], cwd=tmp_path, env=env, check=True)
