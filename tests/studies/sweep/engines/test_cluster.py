"""A sweep on a cluster leaves what one on this machine leaves, whatever dies on the way."""

import logging

import pytest
from distributed import LocalCluster

from studies.base.errors import StudyError
from studies.sweep.engines.requests import Check
from studies.sweep.run_studies import run_studies
from tests.studies.sweep.engines.conftest import assert_equal_bits, engine_at, physics, swept
from tests.studies.tiny import Silent, content, tiny_study


@pytest.mark.filterwarnings("ignore:during the frame times")
def test_a_cluster_leaves_what_this_machine_leaves(scheduler, finished_sweep, tmp_path):
    study = tiny_study()
    count, progress = swept(tmp_path, study, scheduler)
    assert count == len(study.cases) + 2, "two are timed, one diverges"
    assert progress.begun == [("physics", 3), ("timing", 1)], "both workers are of one kind of machine"
    assert_equal_bits(physics(tmp_path, study), physics(finished_sweep, study))
    assert {path.name for path in (tmp_path / "tiny").iterdir()} == {
        path.name for path in (finished_sweep / "tiny").iterdir()
    }
    assert not list((tmp_path / "cache").glob("shared-*")), "its file of the check is gone"
    before = content(tmp_path / "tiny")
    again, progress = swept(tmp_path, study, "tcp://127.0.0.1:9")
    assert (again, progress.begun) == (0, []), "nothing to do needs no cluster"
    assert content(tmp_path / "tiny") == before


def test_a_scheduler_that_is_not_there_is_a_sentence(monkeypatch, tmp_path, tiny_file, refused):
    monkeypatch.setattr("studies.sweep.engines.cluster.CONNECT_SECONDS", 0.5)
    sentence = refused("run", tiny_file, "--results", tmp_path / "results", "--on", "tcp://127.0.0.1:9")
    assert sentence.startswith("organbench: there is no Dask scheduler at tcp://127.0.0.1:9 (")
    assert sentence.endswith("; start one with `dask scheduler`, or correct the address")


@pytest.mark.campaign
def test_a_scheduler_without_workers_is_a_sentence(tmp_path):
    options = {"n_workers": 0, "processes": False, "dashboard_address": ":0", "silence_logs": logging.CRITICAL}
    alone = pytest.raises(StudyError, match=r"has had no worker for 0\.3 s: start some with `organbench worker`")
    with LocalCluster(protocol="tcp://", **options) as cluster, alone, engine_at(cluster.scheduler_address, 0.3) as one:
        run_studies(tmp_path, [tiny_study()], one, Silent())
    assert not (tmp_path / "tiny").exists()


@pytest.mark.campaign
def test_a_folder_that_workers_do_not_see_is_a_sentence(scheduler, tmp_path, monkeypatch):
    elsewhere = tmp_path / "elsewhere" / "cache" / "token"
    monkeypatch.setattr(Check, "__reduce__", lambda self: (Check, (elsewhere, self.content, self.ours, self.files)))
    with pytest.raises(StudyError, match=rf"worker [01] does not see {tmp_path}/elsewhere; put the results"):
        swept(tmp_path, tiny_study(), scheduler)
    assert not (tmp_path / "tiny").exists()


def test_two_ways_to_say_how_many_are_refused(refused, tiny_file, tmp_path):
    sentence = refused("run", tiny_file, "--results", tmp_path, "--jobs", "2", "--on", "local:3")
    assert "give either --jobs or --on" in sentence


def test_a_worker_needs_one_scheduler(refused):
    for words in ((), ("tcp://127.0.0.1:1", "--scheduler-file", "file.json")):
        assert "give either the address of a scheduler or a --scheduler-file" in refused("worker", *words)
