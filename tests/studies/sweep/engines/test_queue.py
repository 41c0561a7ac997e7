"""The file of a cluster, and its workers: of a queue, here a made-up one, or of a program."""

import os
import re
import shutil
import sys
import time
from pathlib import Path

import pytest
from dask import config

from studies.base.errors import StudyError
from studies.sweep.engines.choose import executor_for
from studies.sweep.engines.cluster import Cluster
from studies.sweep.engines.queue import (
    QUEUES,
    Settings,
    cluster_of,
    dask_settings,
    read_settings,
    scheduler_with_workers,
)
from studies.sweep.engines.tls import make_key
from studies.sweep.local import Local

ROOT = Path(__file__).parents[4]
ONE = "from tests.studies.tiny import tiny_case, tiny_study\nSTUDY = tiny_study(cases=(tiny_case(),))\n"
SBATCH = """#!/bin/bash
for last; do :; done
cp "$last" {folder}/script
setsid bash {folder}/script > {folder}/worker.log 2>&1 &
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


@pytest.mark.slow
@pytest.mark.campaign
def test_a_job_does_a_study_and_is_ended(slurm, organbench):
    study, file, results = slurm / "one.py", slurm / "slurm.yaml", slurm / "results"
    study.write_text(ONE)
    file.write_text("kind: slurm\nworkers: 1\nprocesses: 2\nhost: 127.0.0.1\n")
    code, out, err = organbench("run", study, "--results", results, "--on", file)
    assert code == 0 and "Traceback" not in err
    assert "1 jobs of slurm started; what they print is in" in out and "tiny: 1 case ran" in out
    assert "#SBATCH --cpus-per-task=2" in (slurm / "script").read_text()
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
    sentence = refusal(tmp_path, "kind: pbs\nworkers: 2\nhost: 127.0.0.1", refused)
    assert re.search(r"pbs cannot be used here \(.*qsub.*\): correct `kind`, or run on a machine that has it", sentence)


def test_a_job_that_is_refused_is_a_sentence(slurm, refused):
    (slurm / "bin" / "sbatch").write_text("#!/bin/bash\necho no such partition >&2\nexit 1\n")
    sentence = refusal(slurm, "kind: slurm\nworkers: 2\nhost: 127.0.0.1\nqueue: shrt", refused)
    assert re.search(r"slurm did not take a job \(.*no such partition.*\): correct the settings", sentence)


def test_a_program_that_starts_workers_is_started_for_each_and_ended(tmp_path):
    messages, command = [], f"echo $$ {{processes}} {{memory}} ${{EXTRA}} >> {tmp_path}/started; sleep 600 & wait"
    settings = Settings(
        "command", workers=2, processes=3, memory_gb=8, command=command, setup=("EXTRA=x",), host="127.0.0.1"
    )
    with scheduler_with_workers(settings, tmp_path, messages.append) as address:
        assert re.fullmatch(r"tls://127\.0\.0\.1:\d+", address)
        (folder,) = (tmp_path / "cache").iterdir()
        assert address in (folder / "scheduler.json").read_text()
        until = time.monotonic() + 20
        while time.monotonic() < until and len(started(tmp_path)) < 2:
            time.sleep(0.05)
        words = started(tmp_path)
        assert [rest for _, *rest in words] == [["3", "8", "x"]] * 2
    assert all(is_gone(int(group)) for group, *_ in words)
    assert messages == [f"2 workers started; what they print is in {folder}"]
    assert not (folder / "scheduler.json").exists()


def started(folder):
    """The words that each program has written."""
    file = folder / "started"
    return [line.split() for line in file.read_text().splitlines()] if file.exists() else []


def test_the_examples_of_the_docs_are_read(tmp_path):
    text = (ROOT / "docs" / "cluster.md").read_text(encoding="utf-8")
    examples = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    read = []
    for example in examples:
        (tmp_path / "jobs.yaml").write_text(example)
        read.append(read_settings(tmp_path / "jobs.yaml"))
    assert [settings.kind for settings in read] == ["slurm", "command"]


REFUSED = {
    "unknown setting in jobs.yaml 'proceses'; did you mean 'processes'": "kind: slurm\nworkers: 2\nproceses: 3",
    "kind: input should be 'slurm', ": "kind: lfs\nworkers: 2",
    "HTCondor has no `hours`; leave it out": "kind: htcondor\nworkers: 2\nhours: 2",
    "workers: field required": "kind: pbs",
    "workers: input should be greater than or equal to 1": "kind: pbs\nworkers: 0",
    "hours: input should be a valid number, ": "kind: pbs\nworkers: 2\nhours: 2:00:00",
    "a `command` is given for `kind: command`, and for no other kind": "kind: command\nworkers: 2",
    "a `command` is given for": "kind: slurm\nworkers: 2\ncommand: ls",
    "holds no settings; write lines such as `kind: slurm`": "- slurm",
    "cannot be read as YAML": "kind: [slurm",
}


@pytest.mark.parametrize("words", REFUSED)
def test_a_file_that_says_something_else_is_refused(tmp_path, words):
    (tmp_path / "jobs.yaml").write_text(REFUSED[words])
    with pytest.raises(StudyError) as stop:
        read_settings(tmp_path / "jobs.yaml")
    assert words in str(stop.value) and "\n" not in str(stop.value)


def script(folder, **changes):
    """The lines of a job script."""
    given = {"workers": 8, "processes": 16, "hours": 2.5, "memory_gb": 32.0, "queue": "short"}
    settings = Settings(**{**given, "setup": ("module load python",), "host": "127.0.0.1", **changes})
    make_key(folder / "key here")
    with config.set(dask_settings(folder / "key here")), cluster_of(settings, folder / "key here") as cluster:
        return cluster.job_script().splitlines()


@pytest.mark.parametrize(
    ("kind", "directives"),
    [
        ("slurm", {"#SBATCH -p short", "#SBATCH --cpus-per-task=16", "#SBATCH --mem=30G", "#SBATCH -t 02:30:00"}),
        ("pbs", {"#PBS -q short", "#PBS -l select=1:ncpus=16:mem=30GB", "#PBS -l walltime=02:30:00"}),
        ("sge", {"#$ -q short", "#$ -pe smp 16", "#$ -l h_vmem=2000M", "#$ -l h_rt=02:30:00"}),
        ("lsf", {"#BSUB -q short", "#BSUB -n 16", '#BSUB -R "span[hosts=1]"', "#BSUB -W 02:30"}),
        ("oar", {"#OAR -q short", "#OAR -l /nodes=1/core=16,walltime=02:30:00"}),
        ("htcondor", {"MY.DaskWorkerCores = 16", "MY.DaskWorkerMemory = 32000000000", "accounting_group = surgery"}),
    ],
)
def test_a_job_script_asks_for_what_the_file_says(tmp_path, kind, directives):
    changes = {"options": ("accounting_group = surgery",), "hours": None, "queue": ""} if kind == "htcondor" else {}
    lines = script(tmp_path, kind=kind, **changes)
    assert directives <= set(lines), set(directives) - set(lines)
    (worker,) = (line for line in lines if "distributed.cli.dask_worker" in line)
    assert "module load python" in (worker if kind == "htcondor" else lines)
    assert "tls://127.0.0.1:" in worker and "--nthreads 16" in worker and "--no-dashboard" in worker
    assert worker.count("key here/certificate.pem'") >= 2, "the key, whose folder has a space, is quoted"


def test_every_queueing_system_is_tried():
    (mark,) = test_a_job_script_asks_for_what_the_file_says.pytestmark
    assert {kind for kind, _ in mark.args[1]} == set(QUEUES)


def test_a_job_script_has_no_time_where_none_is_given(tmp_path):
    lines = script(tmp_path, kind="slurm", hours=None, memory_gb=None, options=("--account=surgery",))
    assert not [line for line in lines if line.startswith("#SBATCH -t")]
    assert {"#SBATCH --mem=30G", "#SBATCH --account=surgery"} <= set(lines), "2 GB for each process"


def chosen(on, jobs=2):
    return executor_for(on, jobs, Path("results"), print)


def test_words_say_where_jobs_run(tmp_path):
    file = tmp_path / "slurm.yaml"
    file.write_text("kind: slurm\nworkers: 8\nprocesses: 16\n")
    assert [chosen(""), chosen("local", 3), chosen("local:4")] == [Local(2), Local(3), Local(4)]
    there, array = chosen("tcp://127.0.0.1:8786"), chosen(str(file))
    assert isinstance(there, Cluster) and isinstance(array, Cluster) and array.to_come == 8 * 16


ELSEWHERE = {
    "give the number of processes, as local:4": "local:none",
    "give the number of processes": "local:0",
    "give local:N, an address as tcp://HOST:8786, or a FILE.yaml": "slurm",
    "there is no file nowhere.yaml; docs/cluster.md shows how to write one": "nowhere.yaml",
}


@pytest.mark.parametrize("words", ELSEWHERE)
def test_other_words_are_refused(words):
    with pytest.raises(StudyError) as problem:
        chosen(ELSEWHERE[words])
    assert words in str(problem.value)


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    for name in ("cluster", "queue", "worker"):
        monkeypatch.delitem(sys.modules, f"studies.sweep.engines.{name}", raising=False)
    with pytest.raises(StudyError, match=r"needs the extra `cluster`, which is not installed: .*-m pip install"):
        chosen("tcp://127.0.0.1:8786")
