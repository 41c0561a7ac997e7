"""The words after `--on`."""

import sys
from pathlib import Path

import pytest

from studies.base.errors import StudyError
from studies.sweep.engines.choose import executor_for
from studies.sweep.engines.cluster import Cluster
from studies.sweep.local import Local


def chosen(on, jobs=2):
    return executor_for(on, jobs, Path("results"), print)


def test_words_say_where_jobs_run(tmp_path):
    file = tmp_path / "slurm.yaml"
    file.write_text("kind: slurm\nworkers: 8\nprocesses: 16\n")
    assert [chosen(""), chosen("local", 3), chosen("local:4")] == [Local(2), Local(3), Local(4)]
    there, array = chosen("tcp://127.0.0.1:8786"), chosen(str(file))
    assert isinstance(there, Cluster) and isinstance(array, Cluster) and array.to_come == 8 * 16


REFUSED = {
    "give the number of processes, as local:4": "local:none",
    "give the number of processes": "local:0",
    "give local:N, an address as tcp://HOST:8786, or a FILE.yaml": "slurm",
    "there is no file nowhere.yaml; docs/cluster.md shows how to write one": "nowhere.yaml",
}


@pytest.mark.parametrize("words", REFUSED)
def test_other_words_are_refused(words):
    with pytest.raises(StudyError) as problem:
        chosen(REFUSED[words])
    assert words in str(problem.value)


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    for name in ("cluster", "queue", "worker"):
        monkeypatch.delitem(sys.modules, f"studies.sweep.engines.{name}", raising=False)
    with pytest.raises(StudyError, match=r"needs the extra `cluster`, which is not installed: pip install"):
        chosen("tcp://127.0.0.1:8786")
