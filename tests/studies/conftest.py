"""A mesh cache of its own for the whole session, one finished sweep that tests may copy, and the command line."""

import shutil
import sys
import warnings

import pytest

from studies.cli import app as cli
from studies.reference.load import load_reference
from studies.reference.pieces import pieces
from studies.reference.solve import solve
from studies.sweep.run_studies import run_studies
from tests.studies.octant import SCENE
from tests.studies.tiny import TINY, Silent, tiny_study


@pytest.fixture(scope="session", autouse=True)
def mesh_cache(tmp_path_factory):
    """Every mesh is made once a session, also for the processes that a test starts."""
    folder = tmp_path_factory.mktemp("meshes")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ORGANBENCH_CACHE", str(folder))
        yield folder


@pytest.fixture(scope="session")
def finished_sweep(mesh_cache, tmp_path_factory):
    """Results folder of the tiny study, all run and timed; to be copied, not changed."""
    root = tmp_path_factory.mktemp("finished")
    run_studies(root, [tiny_study()], 1, Silent())
    return root


@pytest.fixture(scope="session")
def solved(mesh_cache, tmp_path_factory):
    """Results folder with the reference of the octant, piece by piece."""
    root = tmp_path_factory.mktemp("reference")
    for piece in pieces(SCENE):
        solve(root, piece)
    return root


@pytest.fixture(scope="session")
def found(solved):
    """That reference."""
    return load_reference(solved, SCENE)


@pytest.fixture
def results(finished_sweep, tmp_path):
    """A copy of the finished results that a test may spoil."""
    return shutil.copytree(finished_sweep, tmp_path / "results")


@pytest.fixture
def organbench(monkeypatch, capsys):
    """Calls the command line as the shell does: (exit code, standard output, standard error)."""
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)  # main() sets it; give it back afterwards

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
