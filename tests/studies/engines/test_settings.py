"""The words after `--on`, the file of a job array, and the scripts that come of it."""

import sys
from pathlib import Path

import pytest

from studies.base.errors import StudyError
from studies.engines.choose import engine_for
from studies.engines.cluster import Cluster
from studies.engines.scripts import script
from studies.engines.settings import Settings, read_settings
from studies.sweep.pool import Pool

FULL = """
kind: slurm
workers: 8
processes: 16
hours: 2.5
memory_gb: 32
queue: short
options: ["--account=surgery"]
setup: ["module load python"]
portable: true
"""


def chosen(on, jobs=2):
    return engine_for(on, jobs, False, Path("results"), print)


def test_words_name_engines(tmp_path):
    file = tmp_path / "slurm.yaml"
    file.write_text(FULL)
    assert [chosen(""), chosen("local", 3), chosen("local:4")] == [Pool(2), Pool(3), Pool(4)]
    there, array = chosen("tcp://127.0.0.1:8786"), chosen(str(file))
    assert isinstance(there, Cluster) and not there.portable
    assert isinstance(array, Cluster) and array.portable and array.to_come == 8 * 16


@pytest.mark.parametrize(
    ("on", "told"),
    [
        ("local:none", r"give the number of processes, as local:4"),
        ("local:0", "give the number of processes"),
        ("slurm", r"--on 'slurm' is no engine; give local:N, an address as tcp://HOST:8786, or a FILE\.yaml"),
        ("nowhere.yaml", r"there is no file nowhere\.yaml; write one as docs/cluster\.md shows"),
    ],
)
def test_other_words_are_refused(on, told):
    with pytest.raises(StudyError, match=told):
        chosen(on)


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    for name in ("cluster", "dask", "jobs", "crew", "checks"):
        monkeypatch.delitem(sys.modules, f"studies.engines.{name}", raising=False)
    with pytest.raises(StudyError, match=r"needs the package distributed, which is not installed: pip install"):
        chosen("tcp://127.0.0.1:8786")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("kind: slurm\nworkers: 2\nproceses: 3", r"unknown setting in jobs\.yaml 'proceses'; did you mean 'processes'"),
        ("kind: lsf\nworkers: 2", r"kind: input should be 'slurm', 'sge', 'pbs' or 'command'"),
        ("kind: pbs", r"workers: field required"),
        ("kind: pbs\nworkers: 0", r"workers: input should be greater than or equal to 1"),
        ("kind: pbs\nworkers: 2\nhours: 2:00:00", r"hours: input should be a valid number, .*; correct it"),
        ("kind: command\nworkers: 2", r"a `command` is given for `kind: command`, and for no other kind"),
        ("kind: slurm\nworkers: 2\ncommand: ls", r"a `command` is given for"),
        ("- slurm", r"holds no settings; write lines such as `kind: slurm`"),
        ("kind: [slurm", r"cannot be read as YAML"),
    ],
)
def test_a_file_that_says_something_else_is_refused(tmp_path, text, told):
    file = tmp_path / "jobs.yaml"
    file.write_text(text)
    with pytest.raises(StudyError, match=told) as stop:
        read_settings(file)
    assert "\n" not in str(stop.value)


def written(tmp_path, **changes):
    """The lines of a job script."""
    known = {"kind": "slurm", "workers": 8, "processes": 16, "hours": 2.5, "memory_gb": 32.0, "queue": "short"}
    settings = Settings(**{**known, "setup": ("module load python",), **changes})  # type: ignore[arg-type]
    return script(settings, Path("/logs"), ["organbench", "worker", "a b"], Path("/home/it")).splitlines()


def test_a_script_of_slurm(tmp_path):
    lines = written(tmp_path, options=("--account=surgery",))
    assert lines[0] == "#!/bin/bash"
    assert lines[1:-3] == [
        f"#SBATCH {word}"
        for word in (
            "--job-name=organbench",
            "--array=1-8",
            "--nodes=1",
            "--ntasks=1",
            "--cpus-per-task=16",
            "--output=/logs/worker-%a.log",
            "--time=150",
            "--mem=32000M",
            "--partition=short",
            "--account=surgery",
        )
    ]
    assert lines[-3:] == ["cd /home/it", "module load python", "exec organbench worker 'a b'"]


def test_a_script_of_grid_engine(tmp_path):
    lines = written(tmp_path, kind="sge", parallel_environment="threads")
    assert {"#$ -t 1-8", "#$ -pe threads 16", "#$ -l h_rt=9000", "#$ -l h_vmem=2000M", "#$ -q short"} < set(lines)
    assert "#$ -pe" not in " ".join(written(tmp_path, kind="sge", processes=1))


def test_a_script_of_pbs(tmp_path):
    lines = written(tmp_path, kind="pbs")
    assert {"#PBS -l select=1:ncpus=16:mem=32000mb", "#PBS -J 1-8", "#PBS -l walltime=02:30:00"} < set(lines)
    assert "-J" not in " ".join(written(tmp_path, kind="pbs", workers=1)), "no array of one"
