"""Workers whose code is another, or that have none, as they really answer."""

import json
import os
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from studies.base.errors import StudyError
from studies.sweep.run_studies import run_studies
from tests.studies.engines.conftest import address_in, engine_at
from tests.studies.tiny import Silent, tiny_study

ROOT = Path(__file__).parents[3]
PACKAGES = ("massspring", "reference_fem", "studies")
WITHOUT = """
import sys
sys.modules["studies"] = None
from distributed.cli.dask_worker import main
main()
"""
"""A worker in whose Python organbench is not installed."""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """The file of a scheduler that runs."""
    folder = tmp_path_factory.mktemp("scheduler")
    words = ["--port", "0", "--no-dashboard", "--scheduler-file", str(folder / "file.json"), "--host", "127.0.0.1"]
    with running([sys.executable, "-m", "distributed.cli.dask_scheduler", *words], folder):
        address_in(folder / "file.json")
        yield folder / "file.json"


@contextmanager
def running(words, folder, path=ROOT):
    """A program, with the packages below `path`, until the end."""
    environment = {**os.environ, "PYTHONPATH": str(path)}
    with open(folder / "log", "ab") as log:
        process = subprocess.Popen(words, cwd=folder, env=environment, stdout=log, stderr=log)
    try:
        yield
    finally:
        process.kill()
        process.wait()


def refusal(file, folder):
    """What a sweep there says."""
    with pytest.raises(StudyError) as stop, engine_at(json.loads(file.read_text())["address"], 60.0) as engine:
        run_studies(folder / "results", [tiny_study()], engine, Silent())
    assert not (folder / "results" / "tiny").exists(), "nothing has run"
    return str(stop.value)


@pytest.mark.campaign
def test_a_worker_with_other_code_is_refused_by_name(file, tmp_path):
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    with open(tmp_path / "massspring" / "run" / "simulation.py", "a") as source:
        source.write("\nMENDED = True\n")
    words = ["--scheduler-file", str(file), "--name", "another"]
    with running([sys.executable, "-m", "studies", "worker", *words], tmp_path, tmp_path):
        said = refusal(file, tmp_path)
    assert said.startswith("worker another has other code of organbench; install the same version there")


@pytest.mark.campaign
def test_a_worker_without_organbench_is_refused_by_name(file, tmp_path):
    words = ["--scheduler-file", str(file), "--name", "bare", "--no-dashboard", "--no-nanny"]
    with running([sys.executable, "-c", WITHOUT, *words], tmp_path):
        said = refusal(file, tmp_path)
    assert said.startswith("worker bare has no organbench that can be loaded (")
