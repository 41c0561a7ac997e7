"""One finished sweep that tests may copy, a small reference, and the command line."""

import shutil
import sys
import warnings

import pytest

from studies.cli import app as cli
from studies.reference.load import load_reference
from studies.reference.reference_solves import reference_solves
from studies.reference.solve import solve
from studies.store import opening
from studies.sweep.run_studies import run_studies
from studies.tools.advise import campaign
from tests.conftest import once_per_run
from tests.studies.octant import SCENE
from tests.studies.tiny import TINY, Silent, tiny_study


@pytest.fixture(scope="session")
def finished_sweep(run_folder):
    """Results folder of the tiny study, all run and timed; to be copied, not changed."""
    return once_per_run(run_folder, "finished", lambda root: run_studies(root, [tiny_study()], 1, Silent()))


@pytest.fixture(scope="session")
def solved(run_folder):
    """Results folder with the reference of the octant, piece by piece; to be read, not changed."""

    def make(root):
        for reference_solve in reference_solves(SCENE):
            solve(root, reference_solve)

    return once_per_run(run_folder, "reference", make)


@pytest.fixture(scope="session")
def reference(solved):
    """The reference of the octant."""
    return load_reference(solved, SCENE)


@pytest.fixture
def results(finished_sweep, tmp_path):
    """A copy of the finished results that a test may spoil."""
    return shutil.copytree(finished_sweep, tmp_path / "results")


@pytest.fixture
def no_tables(monkeypatch, tmp_path):
    """As if the program had come without its published tables."""
    monkeypatch.setattr(campaign, "PACKAGE", tmp_path / "nowhere" / "studies")


@pytest.fixture
def organbench(monkeypatch, capsys):
    """Calls the command line as the shell does: (exit code, standard output, standard error)."""
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)  # main() sets it; give it back afterwards
    monkeypatch.setenv(cli.TRACEBACK, "1")  # an unforeseen error fails the test where it is raised

    def call(*words):
        monkeypatch.setattr(sys, "argv", ["organbench", *map(str, words)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        out, err = capsys.readouterr()
        return stop.value.code, out, err

    return call


@pytest.fixture
def refused(organbench):
    """Calls with bad input: checks code and form of the complaint, gives the sentence."""

    def call(*words) -> str:
        code, out, err = organbench(*words)
        assert code == 2
        assert out == ""
        (sentence,) = err.splitlines()
        assert sentence.startswith("organbench: ")
        return sentence

    return call


@pytest.fixture
def tiny_file(tmp_path):
    path = tmp_path / "tiny_file.py"
    path.write_text(TINY)
    return path


@pytest.fixture
def opened(monkeypatch):
    """Names of the results files that are read, as they are."""
    names = []
    check = opening.check_seal
    monkeypatch.setattr(opening, "check_seal", lambda path: names.append(path.name) or check(path))
    return names
