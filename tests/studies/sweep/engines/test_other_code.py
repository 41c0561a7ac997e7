"""Workers whose code is another, or that have none, as they really answer."""

import json
import os
import shutil
import subprocess
import sys
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest

from studies.base.errors import StudyError
from studies.sweep.find_study import find_study
from studies.sweep.run_studies import run_studies
from tests.studies.sweep.engines.conftest import address_in, engine_at
from tests.studies.tiny import Silent, tiny_study

ROOT = Path(__file__).parents[4]
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
def running(words, folder, path: "Path | str" = ROOT):
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


@pytest.fixture
def other_code(tmp_path):
    """A folder with the packages, one of which is edited."""
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    with open(tmp_path / "massspring" / "run" / "simulation.py", "a") as source:
        source.write("\nEDITED = True\n")
    return tmp_path


def worker(file, name):
    return [sys.executable, "-m", "studies", "worker", "--scheduler-file", str(file), "--name", name]


@pytest.mark.campaign
def test_a_worker_with_other_code_is_refused_by_name(file, other_code):
    with running(worker(file, "another"), other_code, other_code):
        sentence = refusal(file, other_code)
    assert sentence.startswith("worker another differs in the code of organbench; put the same version there")


WAITS = """
import time
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from massspring import Free
from tests.studies.tiny import tiny_case, tiny_study


@dataclass(frozen=True)
class Waits(Free):
    name: ClassVar[str] = "waits"
    file: str = ""

    def advance(self, state, boundary):
        until = time.monotonic() + 120
        while not Path(self.file).exists() and time.monotonic() < until:
            time.sleep(0.05)
        return super().advance(state, boundary)


FILES = ("", *2 * [str(Path(__file__).with_name("go-on"))])
STUDY = tiny_study(cases=tuple(tiny_case(method=Waits(file=f), dt_fraction=0.4 + k / 20) for k, f in enumerate(FILES)))
"""
"""A study whose cases but the first, which is the longest, wait for a file."""


@pytest.mark.campaign
def test_a_worker_that_joins_later_with_other_code_gets_nothing(file, other_code, tmp_path_factory, monkeypatch):
    here, warnings = tmp_path_factory.mktemp("here"), []
    (here / "waits.py").write_text(WAITS)
    study = find_study(str(here / "waits.py"))

    def warned(text, stacklevel):
        warnings.append(text)
        (here / "go-on").touch()

    class Follower(Silent):
        def advance(self, what, note):
            super().advance(what, note)
            if len(self.done) == 1:
                later.enter_context(running(worker(file, "late"), other_code, f"{other_code}:{ROOT}"))

    monkeypatch.setattr("studies.sweep.engines.cluster.warnings", SimpleNamespace(warn=warned))
    address = json.loads(file.read_text())["address"]
    with running(worker(file, "good"), here), engine_at(address, 60.0) as one, ExitStack() as later:
        run_studies(here / "results", [study], one, Follower())
    fault = "differs in the code of organbench; put the same version there, and start the worker again"
    assert warnings == [f"worker late {fault}; it gets no job"]
    assert len(list((here / "results" / "tiny").iterdir())) == 3


@pytest.mark.campaign
def test_a_worker_without_organbench_is_refused_by_name(file, tmp_path):
    words = ["--scheduler-file", str(file), "--name", "bare", "--no-dashboard", "--no-nanny"]
    with running([sys.executable, "-c", WITHOUT, *words], tmp_path):
        sentence = refusal(file, tmp_path)
    assert sentence.startswith("worker bare cannot load organbench;")
