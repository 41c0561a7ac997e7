"""Workers that a command starts, and ends: by a queueing system, here a made-up one, and by a program."""

import os
import re
import shutil
import time
from pathlib import Path

import pytest

from studies.engines import jobs
from studies.engines.settings import Settings, read_settings

ROOT = Path(__file__).parents[3]
ONE = "from tests.studies.tiny import tiny_case, tiny_study\nSTUDY = tiny_study(cases=(tiny_case(),))\n"
SBATCH = """#!/bin/bash
for last; do :; done
cp "$last" {folder}/script
setsid bash "$last" > {folder}/worker.log 2>&1 &
echo $! > {folder}/process
echo "4711;cluster"
"""
SCANCEL = """#!/bin/bash
echo "$1" > {folder}/ended
kill -- -$(cat {folder}/process)
"""


@pytest.fixture
def slurm(tmp_path, monkeypatch):
    """A folder with programs that take a job and end it, as SLURM does; they stand before all others."""
    for name, text in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        program = tmp_path / "bin" / name
        program.parent.mkdir(exist_ok=True)
        program.write_text(text.format(folder=tmp_path))
        program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    return tmp_path


@pytest.mark.campaign
def test_a_job_array_does_a_study_and_is_ended(slurm, organbench):
    study, file, results = slurm / "one.py", slurm / "slurm.yaml", slurm / "results"
    study.write_text(ONE)
    file.write_text("kind: slurm\nworkers: 1\nprocesses: 2\nhost: 127.0.0.1\n")
    code, out, err = organbench("run", study, "--results", results, "--on", file)
    assert (code, err) == (0, "")
    assert "job 4711 with 1 workers; what they print is in" in out and "tiny: 1 case ran" in out
    assert "#SBATCH --array=1-1" in (slurm / "script").read_text()
    assert (slurm / "ended").read_text() == "4711\n"
    group = int((slurm / "process").read_text())
    assert is_gone(group), "no worker is left"
    assert organbench("run", study, "--results", results, "--on", file)[0] == 0
    assert len(list((results / "cache").glob("workers-*"))) == 1, "nothing to do asks for no job"


def is_gone(group, seconds=20.0):
    """Whether every process of a group has ended within so many seconds."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


def refusal(tmp_path, text, refused):
    """The sentence for a study on an array."""
    (tmp_path / "one.py").write_text(ONE)
    (tmp_path / "jobs.yaml").write_text(text)
    return refused("run", tmp_path / "one.py", "--results", tmp_path / "results", "--on", tmp_path / "jobs.yaml")


def test_a_queueing_system_that_is_not_here_is_a_sentence(tmp_path, monkeypatch, refused):
    (tmp_path / "openssl").symlink_to(str(shutil.which("openssl")))
    monkeypatch.setenv("PATH", str(tmp_path))
    said = refusal(tmp_path, "kind: pbs\nworkers: 2\nhost: 127.0.0.1", refused)
    assert re.search(r"`qsub .*workers\.sh` cannot be run \(.*\): correct `kind`, or run where it is", said)


def test_a_job_that_is_refused_is_a_sentence(slurm, refused):
    (slurm / "bin" / "sbatch").write_text("#!/bin/bash\necho no such partition >&2\nexit 1\n")
    said = refusal(slurm, "kind: slurm\nworkers: 2\nhost: 127.0.0.1\nqueue: shrt", refused)
    assert "was refused (no such partition): correct the settings" in said


@pytest.mark.campaign
def test_a_program_that_starts_workers_is_started_for_each_and_ended(tmp_path):
    told, command = [], f"echo $$ {{processes}} {{memory}} ${{EXTRA}} >> {tmp_path}/started; sleep 600 & wait"
    settings = Settings(
        "command", workers=2, processes=3, memory_gb=8, command=command, setup=("EXTRA=x",), host="127.0.0.1"
    )
    with jobs.scheduler_with_jobs(settings, tmp_path, told.append) as address:
        assert re.fullmatch(r"tls://127\.0\.0\.1:\d+", address)
        (folder,) = (tmp_path / "cache").iterdir()
        assert address in (folder / "scheduler.json").read_text()
        until = time.monotonic() + 20
        while time.monotonic() < until and len(started(tmp_path)) < 2:
            time.sleep(0.05)
        words = started(tmp_path)
        assert [rest for _, *rest in words] == [["3", "8", "x"]] * 2
    assert all(is_gone(int(group)) for group, *_ in words)
    assert told == [f"2 workers started; what they print is in {folder}"]
    assert not (folder / "scheduler.json").exists()


def started(folder):
    """What each program that was started has said."""
    file = folder / "started"
    return [line.split() for line in file.read_text().splitlines()] if file.exists() else []


def test_the_examples_of_the_docs_are_read(tmp_path):
    text = (ROOT / "docs" / "cluster.md").read_text(encoding="utf-8")
    found = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    read = []
    for example in found:
        (tmp_path / "jobs.yaml").write_text(example)
        read.append(read_settings(tmp_path / "jobs.yaml"))
    assert [settings.kind for settings in read] == ["slurm", "command"]
