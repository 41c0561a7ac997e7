"""Frame times on a cluster, with workers that are made up: after all pieces, alone, once for each kind of machine."""

import time
from dataclasses import replace

import pytest

from studies.base.errors import StudyError
from studies.engines import requests
from studies.engines.cluster import Cluster
from studies.engines.requests import FrameTimes, Presence, busy_share
from studies.store.ledger import Ledger
from studies.sweep.tasks import case_tasks
from tests.studies.engines.made_up import MadeUp, worker
from tests.studies.tiny import Silent, tiny_case, tiny_study

MACHINES = {"a": "one", "b": "one", "c": "other", "d": "other"}
"""Address of a worker -> id of its machine."""


@pytest.fixture(autouse=True)
def one_content(monkeypatch):
    """Every file of a check holds the same."""
    monkeypatch.setattr("studies.engines.checks.secrets.token_hex", lambda count: "0" * count)


def measured(root, answer):
    """What `measure` gives, what it told, and to whom the work went."""

    def value(address, request):
        if isinstance(request, Presence):
            identity, content = request.answer()
            return replace(identity, machine=MACHINES[address]), content
        asked.append((address, len(lines.answers)))
        return answer(address)

    asked, progress = [], Silent()
    lines = MadeUp(value, **{name: worker(name) for name in MACHINES})
    engine = Cluster(lambda: None, 1.0)  # type: ignore[arg-type]
    engine.lines = lines  # type: ignore[assignment]
    return engine.measure(root, tiny_study(), progress, print, None), progress, asked


def test_one_worker_of_each_kind_of_machine_measures_with_nothing_beside(tmp_path):
    count, progress, asked = measured(tmp_path, lambda address: (3, 0.0))
    assert (count, progress.begun) == (6, [("timing", 2)])
    assert asked == [("a", 0), ("c", 0)], "the second is asked when the first has answered"


def test_a_machine_that_others_use_is_told_of(tmp_path):
    with pytest.warns(UserWarning, match=r"beside the frame times of tiny others used 40 % .* of worker c: take them"):
        measured(tmp_path, lambda address: (3, 0.4 if address == "c" else 0.05))


def test_a_worker_that_is_lost_meanwhile_is_a_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr("studies.engines.crew.LOOK_SECONDS", 0.0)
    with pytest.raises(StudyError, match="worker a was lost while it measured frame times; the same command goes on"):
        measured(tmp_path, lambda address: None)


def timed_somewhere(root):
    return [Ledger(root).timed_somewhere(task) for task in case_tasks(root, tiny_study())]


def test_what_any_machine_has_timed_asks_for_no_cluster(results):
    study = tiny_study()
    assert timed_somewhere(results) == [True, True, True]
    assert Cluster(lambda: None, 1.0).measure(results, study, Silent(), print, None) == 0  # type: ignore[arg-type]
    for file in (results / "tiny").glob("*.timing.*.h5"):
        file.unlink()
    assert timed_somewhere(results) == [False, False, True], "one diverges"


def test_the_share_of_a_machine_that_is_busy(tmp_path, monkeypatch):
    stat = tmp_path / "stat"
    stat.write_text("cpu  100 0 100 700 100 0 0 0 50 0\n")
    monkeypatch.setattr(requests, "STAT", stat)
    monkeypatch.setattr(time, "sleep", lambda seconds: stat.write_text("cpu  130 0 130 720 120 0 0 0 90 0\n"))
    assert busy_share() == pytest.approx(0.6), "idle and waiting for a disk: 40 of 100 ticks"
    monkeypatch.setattr(requests, "STAT", tmp_path / "none")
    assert busy_share() != busy_share(), "not a number"


def test_the_request_times_what_is_not_timed(results, monkeypatch):
    monkeypatch.setattr(requests, "WATCHED", 0.0)
    monkeypatch.setattr(requests, "busy_share", lambda: 0.25)
    assert FrameTimes(results, "tiny", (tiny_case(timed=True),), None).answer() == (0, 0.25)
