"""A mesh cache of its own for the whole session, and one finished sweep that tests may copy."""

import shutil

import pytest

from studies.sweep import run_studies
from tests.studies.tiny import Silent, tiny_study


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


@pytest.fixture
def results(finished_sweep, tmp_path):
    """A copy of the finished results that a test may spoil."""
    return shutil.copytree(finished_sweep, tmp_path / "results")
