"""A sweep on a cluster leaves what one on this machine leaves, whatever dies on the way."""

import logging
from contextlib import contextmanager
from types import SimpleNamespace

import pytest
from distributed import LocalCluster

from studies.base.errors import StudyError
from studies.store.ledger import Ledger
from studies.store.record import Status
from studies.sweep.engines.cluster import Cluster, Session, timed_on
from studies.sweep.find_study import find_study
from studies.sweep.load import load_runs
from studies.sweep.run_studies import Failures, run_studies
from tests.studies.sweep.engines.conftest import assert_equal_bits, physics, swept
from tests.studies.sweep.test_failures import FATAL
from tests.studies.tiny import FRAMES, Silent, content, tiny_study


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


class Workers:
    """A client of made-up workers, by name: the ids of their machines."""

    status = "running"

    def __init__(self, **machines):
        self.machines, self.session, self.fit = machines, "", machines

    def scheduler_info(self, n_workers):
        granted = {name: {self.session: 1} if name in self.fit else {} for name in self.machines}
        return {"workers": {name: {"name": name, "resources": granted[name], "nthreads": 1} for name in self.machines}}

    def run(self, ask, *words, workers=()):
        return {name: self.machines[name] for name in workers or self.machines}


def session_of(workers, patience=20.0):
    session = Session(workers, patience)
    workers.session = session.name
    return session


def test_a_scheduler_that_is_gone_or_without_workers_for_too_long_is_a_sentence():
    gone = session_of(SimpleNamespace(status="closed"))
    with pytest.raises(StudyError, match="the Dask scheduler no longer answers"):
        gone.fit()
    with pytest.raises(StudyError, match="has had no worker for 0 s: start some with `organbench worker`"):
        session_of(Workers(), 0.0).fit()


def test_a_worker_that_joins_unfit_gets_nothing_and_a_warning():
    workers = Workers(good="a", late="b")
    workers.fit = ("good",)
    session = session_of(workers)
    session.faults.put("worker late differs in the code of organbench")
    with pytest.warns(UserWarning, match="worker late differs in the code of organbench; it gets no job"):
        assert list(session.fit()) == ["good"]


def test_a_worker_without_organbench_is_refused_by_name():
    with pytest.raises(StudyError, match="worker bare cannot load organbench; install it there; nothing has run"):
        session_of(Workers(good="a", bare=None)).begin(SimpleNamespace())


def measured(root, answer, monkeypatch):
    """What `measure` gives, its progress, and the workers that were asked."""
    session, asked = session_of(Workers(a="one", b="one", c="other", d="other")), []

    class Here(Cluster):
        @contextmanager
        def _session(self, root, files):
            yield session

    def timed(session, place, *words):
        asked.append(place)
        return answer

    monkeypatch.setattr("studies.sweep.engines.cluster.timed_on", timed)
    executor, progress = Here(lambda: None, 1.0), Silent()
    executor.client = session.client
    return executor.measure(Ledger(root), tiny_study(), progress, print, None), progress, asked


def test_one_worker_of_each_kind_of_machine_measures_frame_times(tmp_path, results, monkeypatch):
    count, progress, asked = measured(tmp_path, 3, monkeypatch)
    assert (count, progress.begun, asked) == (6, [("timing", 2)], ["a", "c"])
    no_scheduler = Cluster(lambda: None, 1.0)
    assert no_scheduler.measure(Ledger(results), tiny_study(), Silent(), print, None) == 0, "all are timed somewhere"


def test_frame_times_next_to_others_are_a_warning_and_a_lost_worker_is_a_sentence(monkeypatch):
    import pickle

    session = session_of(Workers(a="one"))
    session.submit = lambda request, workers: SimpleNamespace(result=lambda: pickle.dumps((3, 0.4)))
    monkeypatch.setattr(Session, "ended", lambda self, futures: futures)
    with pytest.warns(UserWarning, match="during the frame times of tiny other programs used 40 % .* of worker a"):
        assert timed_on(session, "a", "a", print, "tiny") == 3
    monkeypatch.setattr(Session, "ended", lambda self, futures: [])
    with pytest.raises(StudyError, match="worker gone was lost while it measured frame times"):
        timed_on(session, "gone", "gone", print, "tiny")


def test_a_scheduler_that_is_not_there_is_a_sentence(monkeypatch, tmp_path, tiny_file, refused):
    monkeypatch.setattr("studies.sweep.engines.cluster.CONNECT_SECONDS", 0.5)
    sentence = refused("run", tiny_file, "--results", tmp_path / "results", "--on", "tcp://127.0.0.1:9")
    assert sentence.startswith("organbench: there is no Dask scheduler at tcp://127.0.0.1:9 (")
    assert sentence.endswith("; start one with `dask scheduler`, or correct the address")


KILLS = """
import os, signal, time
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from massspring import Free
from tests.studies.tiny import tiny_case, tiny_study


@dataclass(frozen=True)
class Kills(Free):
    name: ClassVar[str] = "kills"
    folder: str = ""
    deadly: bool = False

    def advance(self, state, boundary):
        with open(Path(self.folder) / "frames", "a") as file:
            file.write(".")
        if self.deadly and not (Path(self.folder) / "killed").exists():
            (Path(self.folder) / "killed").touch()
            os.kill(os.getppid(), signal.SIGKILL)
            time.sleep(60)
        return super().advance(state, boundary)


FOLDER = str(Path(__file__).parent)
STUDY = tiny_study(cases=tuple(
    tiny_case(method=Kills(folder=FOLDER, deadly=fraction == 0.4), dt_fraction=fraction)
    for fraction in (0.5, 0.45, 0.4, 0.35, 0.3)
))
"""
"""A study in which one case kills the worker that has it, once; every frame leaves a mark."""


def written(folder, text):
    """A study file of a user, loaded."""
    folder.mkdir(exist_ok=True)
    (folder / "mine.py").write_text(text)
    return find_study(str(folder / "mine.py"))


@pytest.mark.campaign
def test_a_worker_that_is_killed_costs_no_case(tmp_path):
    study = written(tmp_path / "study", KILLS)
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": ":0", "silence_logs": logging.CRITICAL}
    with LocalCluster(**options) as cluster:
        count, progress = swept(tmp_path / "killed", study, cluster.scheduler_address)
    frames = tmp_path / "study" / "frames"
    assert (tmp_path / "study" / "killed").exists()
    assert count == 5 and sorted(note for _, note in progress.done) == sorted(case.name for case in study.cases)
    assert frames.stat().st_size == 5 * FRAMES + 1, "a finished piece does not run again, the killed one once"
    assert len(list((tmp_path / "killed" / "tiny").iterdir())) == 5, "each is stored once, nothing is half-written"
    run_studies(tmp_path / "undisturbed", [study], 1, Silent())
    assert_equal_bits(physics(tmp_path / "killed", study), physics(tmp_path / "undisturbed", study))


def test_a_case_that_ends_its_process_is_stored_as_failed_and_the_rest_goes_on(scheduler, tmp_path):
    fatal = FATAL.replace('"fatal"', '"fatal_there"')  # a process knows one method of each name
    study, failures = written(tmp_path / "study", fatal), Failures()
    swept(tmp_path / "results", study, scheduler, failures=failures)
    (cause,) = failures.causes.values()
    assert cause.startswith("its process died 3 times: killed by SIGKILL")
    runs, _ = load_runs(tmp_path / "results", study)
    assert [run.record.status for run in runs] == [Status.FAILED, Status.OK]
