"""`organbench doctor` finds what a test takes away, and names the command that repairs it."""

import os
import re
import shutil
import subprocess
import sys
from collections import namedtuple
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from studies.runs.current import case_path
from studies.tools.doctor import machine as machine_checks
from studies.tools.doctor import software
from studies.tools.doctor.finding import Level
from studies.tools.doctor.results_folder import results_folder
from tests.studies.tiny import tiny_case

ROOT = Path(__file__).parents[4]
SPACE = namedtuple("SPACE", "total used free")


def test_nothing_required_is_missing_where_the_tests_run():
    needed = software.required()
    assert {"numpy", "gmsh", "typer"} <= {one.name for one in needed}
    assert software.packages(needed).level is Level.OK


def test_an_extra_adds_to_what_is_required():
    assert {one.name for one in software.required("view")} == {"pyvista", "vtk"}
    assert "view" in software.extras() and "dev" not in software.extras()


def test_a_package_that_is_missing_or_too_old_is_named_with_the_line_that_installs_it():
    finding = software.packages([Requirement("not-there>=2"), Requirement("numpy>=999"), Requirement("scipy>=1")])
    assert finding.level is Level.FAULT
    assert "not-there is not installed, numpy is " in finding.sentence and "but >=999 is required" in finding.sentence
    assert finding.mend == f"{sys.executable} -m pip install 'not-there>=2' 'numpy>=999'"


def test_an_extra_that_is_missing_is_no_fault():
    finding = software.extra("view", [Requirement("not-there>=2")])
    assert (finding.level, finding.mend) == (Level.NOTE, f"{sys.executable} -m pip install 'not-there>=2'")


def test_a_package_of_another_distribution_by_a_name_of_ours_is_found(monkeypatch):
    monkeypatch.setattr(software, "packages_distributions", lambda: {"studies": ["organbench"]})
    assert [finding.level for finding in software.foreign()] == [Level.OK]
    owners = {"massspring": ["organbench", "massspring"], "studies": ["other", "organbench"]}
    monkeypatch.setattr(software, "packages_distributions", lambda: owners)
    first, second = software.foreign()
    assert first.level is Level.FAULT and "massspring is also a package of massspring" in first.sentence
    assert f"{sys.executable} -m pip uninstall other" in second.mend


def test_a_distribution_that_is_not_installed_is_a_fault(monkeypatch):
    def absent(name):
        raise PackageNotFoundError(name)

    monkeypatch.setattr(software, "requires", absent)
    (finding,) = software.software()
    assert finding.level is Level.FAULT and finding.mend.endswith("pip install --editable .")


@pytest.fixture
def broken(tmp_path, monkeypatch):
    """A module gmsh that fails with a line of code, in every process that is started."""

    def write(line: str) -> None:
        (tmp_path / "gmsh.py").write_text(line + "\n")
        monkeypatch.setenv("PYTHONPATH", str(tmp_path))

    return write


def test_a_missing_system_library_is_named_with_the_packages_of_debian(broken):
    broken("raise OSError('libGLU.so.1: cannot open shared object file: No such file or directory')")
    finding = software.loads("gmsh")
    assert finding.level is Level.FAULT and "libGLU.so.1" in finding.sentence
    assert "libglu1-mesa" in finding.mend and (shutil.which("apt-get") is None or "apt-get install -y" in finding.mend)


@pytest.mark.parametrize("line", ["raise ImportError('half a package')", "import os; os.abort()"])
def test_a_package_that_is_there_and_does_not_load_is_reinstalled(broken, line):
    broken(line)
    finding = software.loads("gmsh")
    assert finding.level is Level.FAULT and "--force-reinstall --no-deps gmsh==" in finding.mend


def test_elsewhere_than_on_debian_the_packages_are_named(monkeypatch):
    monkeypatch.setattr(software.shutil, "which", lambda name: None)
    assert software.system_libraries().startswith("# install the equivalents")


def test_set_up_installs_the_same_system_libraries():
    text = (ROOT / ".ci/setup").read_text()
    (listed,) = re.findall(r'^gmsh_libraries="([^"]*)"', text, re.M)
    assert tuple(listed.replace("\\\n", " ").split()) == software.GMSH_LIBRARIES


def test_a_cache_that_cannot_be_written_to(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    folder = tmp_path / "file" / "cache"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    finding = machine_checks.cache("compiled code", folder, "NUMBA_CACHE_DIR")
    assert (finding.level, finding.mend) == (Level.FAULT, "unset NUMBA_CACHE_DIR")
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    again = machine_checks.cache("compiled code", folder, "NUMBA_CACHE_DIR")
    assert again.mend.startswith("export NUMBA_CACHE_DIR=")
    assert machine_checks.cache("compiled code", tmp_path / "new", "NUMBA_CACHE_DIR").level is Level.OK


def test_a_disk_without_room(tmp_path, monkeypatch):
    monkeypatch.setattr(machine_checks.shutil, "disk_usage", lambda folder: SPACE(10**12, 10**12, 5 * 10**8))
    finding = machine_checks.room("results", tmp_path / "not" / "yet")
    assert finding.level is Level.FAULT and "0.5 GB free" in finding.sentence and str(tmp_path) in finding.mend


def test_little_memory_one_core_and_no_compiler(monkeypatch):
    assert machine_checks.memory(2).mend == "organbench run --jobs 1"
    assert machine_checks.memory(8).level is Level.OK
    monkeypatch.setattr(machine_checks.os, "sched_getaffinity", lambda pid: {0}, raising=False)
    assert machine_checks.cores().level is Level.NOTE
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert machine_checks.compiler().mend == "unset NUMBA_DISABLE_JIT"


def test_a_results_folder_that_is_not_there_or_is_a_file(tmp_path):
    assert results_folder(tmp_path / "results", [])[0].level is Level.NOTE
    (tmp_path / "file").write_text("")
    assert results_folder(tmp_path / "file", [])[0].level is Level.FAULT


@pytest.mark.slow
def test_results_that_are_damaged_or_of_another_version(results):
    (good,) = results_folder(results, ["tiny"])
    assert good.level is Level.OK and good.sentence.startswith("5 results files of schema 2")
    path = case_path(results, "tiny", tiny_case())
    path.write_bytes(path.read_bytes()[:-100])
    (results / "old").mkdir()
    (results / "old" / "case.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(600))
    good, other, bad = results_folder(results, ["tiny"])
    assert good.sentence.startswith("4 results files")
    assert other.level is Level.NOTE and other.mend == f"rm {results / 'old' / 'case.h5'}"
    assert bad.level is Level.FAULT and path.name in bad.sentence
    assert bad.mend == f"organbench run tiny --only stale --results {results}"


@pytest.mark.campaign
def test_the_command_ends_with_0_here_and_with_1_where_something_is_missing(tmp_path):
    command = [sys.executable, "-m", "studies", "doctor", "--results", str(tmp_path / "results")]
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    good = subprocess.run(command, env=env, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert good.returncode == 0, good.stdout + good.stderr
    assert good.stdout.endswith("nothing required is missing\n") and "note   no results yet" in good.stdout
    (tmp_path / "gmsh.py").write_text("raise OSError('libGLU.so.1: cannot open shared object file')\n")
    env["PYTHONPATH"] += os.pathsep + str(tmp_path)
    bad = subprocess.run(command, env=env, cwd="/", capture_output=True, text=True, check=False)
    assert bad.returncode == 1 and bad.stdout.splitlines()[-1].startswith("1 of ")
    assert "fault  gmsh does not load: OSError: libGLU.so.1" in bad.stdout
