"""Frame times on a cluster of made-up workers: after all jobs, alone, once for each kind of machine."""

from contextlib import contextmanager
from types import SimpleNamespace

import psutil
import pytest

from studies.base.errors import StudyError
from studies.store.ledger import Ledger
from studies.sweep.engines.cluster import Cluster
from studies.sweep.engines.requests import FrameTimes
from studies.sweep.job import case_jobs
from tests.studies.tiny import Silent, tiny_case, tiny_study

MACHINES = {"a": "one", "b": "one", "c": "other", "d": "other"}
"""Address of a worker -> id of its machine."""


class MadeUp:
    """A session whose workers answer at once, or leave where there is no answer."""

    name = "session"

    def __init__(self, answer):
        self.answer, self.workers = answer, []
        self.machines = {place: {"name": place} for place in MACHINES}
        self.client = SimpleNamespace(run=lambda ask, name, workers: {place: MACHINES[place] for place in workers})

    def fit(self):
        return self.machines

    def submit(self, request, workers):
        self.workers.append(workers[0])
        if self.answer(workers[0]) is None:
            del self.machines[workers[0]]
        return workers[0]

    def ended(self, futures):
        return [place for place in futures if self.answer(place) is not None]

    def result(self, place):
        return self.answer(place)


def measured(root, answer):
    """What `measure` gives, its progress, and the workers that got the work."""

    class Here(Cluster):
        @contextmanager
        def _session(self, root, files):
            yield session

    session, progress = MadeUp(answer), Silent()
    executor = Here(lambda: None, 1.0)  # type: ignore[arg-type]
    executor.client = session.client  # type: ignore[assignment]
    return executor.measure(Ledger(root), tiny_study(), progress, print, None), progress, session.workers


def test_one_worker_of_each_kind_of_machine_measures(tmp_path):
    count, progress, workers = measured(tmp_path, lambda place: (3, 0.0))
    assert (count, progress.begun) == (6, [("timing", 2)])
    assert workers == ["a", "c"]


def test_a_warning_names_a_machine_that_others_use(tmp_path):
    with pytest.warns(
        UserWarning, match=r"during the frame times of tiny other programs used 40 % .* of worker c: the times may"
    ):
        measured(tmp_path, lambda place: (3, 0.4 if place == "c" else 0.05))


def test_a_worker_that_is_lost_meanwhile_is_a_sentence(tmp_path):
    with pytest.raises(StudyError, match="worker a was lost while it measured frame times; the same command goes on"):
        measured(tmp_path, lambda place: None)


def timed_somewhere(root):
    return [Ledger(root).timed_somewhere(job) for job in case_jobs(root, tiny_study())]


def test_what_any_machine_has_timed_asks_for_no_cluster(results):
    study = tiny_study()
    assert timed_somewhere(results) == [True, True, True]
    assert Cluster(lambda: None, 1.0).measure(Ledger(results), study, Silent(), print, None) == 0  # type: ignore[arg-type]
    for file in (results / "tiny").glob("*.timing.*.h5"):
        file.unlink()
    assert timed_somewhere(results) == [False, False, True], "one diverges"


def test_the_request_times_what_is_not_timed(results, monkeypatch):
    monkeypatch.setattr(psutil, "cpu_percent", lambda seconds: 25.0)
    assert FrameTimes(results, "tiny", (tiny_case(timed=True),), None).answer() == (0, 0.25)
