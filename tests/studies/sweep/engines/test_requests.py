"""Conditions that a worker meets before it gets a job, and what it is asked to do."""

import os
import pickle
from functools import partial
from pathlib import Path
from threading import Lock, Timer

import psutil
import pytest

from studies.base.errors import StudyError
from studies.sweep.engines.requests import check_for, identity, prepare, time_study, wait_until_seen
from studies.sweep.engines.worker import JobPlugin
from tests.studies.tiny import tiny_case, tiny_study


@pytest.fixture
def check(tmp_path):
    with check_for(tmp_path, ()) as made:
        yield made


def fault(check, **changes):
    """What the check says where the client has other versions, or its file is elsewhere."""
    token, content, ours, files = check.args
    versions = {name: value for name, value in changes.items() if name in ours}
    return partial(check.func, changes.get("token", token), changes.get("content", content), ours | versions, files)()[
        1
    ]


def test_a_worker_like_this_one_is_fit(check):
    token = check.args[0]
    assert check()[1] == ""
    assert [path.name for path in token.parent.iterdir()] == [token.name], "no trial is left"


UNFIT = {
    "; put the results on a folder that every worker shares": {"content": "older"},
    "does not see elsewhere; ": {"token": Path("elsewhere/cache/token")},
    "and this machine has 0.1; install the same version there": {"numba": "0.1"},
    "and this machine has 3.9; ": {"Python": "3.9"},
    "differs in the code of organbench; put the same version there": {"the code of organbench": "0"},
}


@pytest.mark.parametrize("words", UNFIT)
def test_what_is_wrong_with_a_worker_is_a_sentence(check, words):
    assert words in fault(check, **UNFIT[words])


def test_modules_next_to_a_file_of_the_user_are_compared(tmp_path, check):
    (tmp_path / "mine.py").write_text("import helper")
    (tmp_path / "helper.py").write_text("x = 1")
    given = ((str(tmp_path / "mine.py"), b"import helper"),)
    token, content, *_ = check.args
    again = partial(check.func, token, content, identity(given), given)
    assert again()[1] == ""
    (tmp_path / "helper.py").write_text("x = 2")
    assert again()[1].startswith(f"differs in the modules next to {tmp_path / 'mine.py'}")


def test_files_of_other_machines_are_waited_for(tmp_path):
    late = tmp_path / "late.h5"
    Timer(0.3, late.touch).start()
    wait_until_seen([late, tmp_path], 20.0)
    with pytest.raises(StudyError, match=r"never\.h5 was written by a worker and is not seen here after 0\.2 s"):
        wait_until_seen([late, tmp_path / "never.h5"], 0.2)


def test_frame_times_are_those_that_this_machine_lacks(results, monkeypatch):
    monkeypatch.setattr(psutil, "cpu_percent", lambda seconds: 25.0)
    assert time_study(results, tiny_study(cases=(tiny_case(timed=True),)), None) == (0, 0.25)


def deadly():
    """A check that ends its process."""
    os._exit(3)


@pytest.mark.parametrize(
    ("content", "lethal", "fault"),
    [
        (b"x = 1", False, ""),
        (b"x = 1", True, "cannot start a process for organbench: it ended with exit code 3"),
        (b"import nowhere", False, "cannot begin: mine.py cannot be loaded: "),
    ],
)
def test_a_worker_whose_process_fails_is_unfit(tmp_path, content, lethal, fault):
    (tmp_path / "mine.py").write_bytes(content)
    preparation = partial(prepare, str(tmp_path), (("mine.py", content),))
    with check_for(tmp_path, ()) as check:
        plugin = JobPlugin("session", {}, pickle.dumps(preparation), pickle.dumps(deadly if lethal else check))
        plugin.lock, plugin.children = Lock(), []
        try:
            said = plugin.fault()
        finally:
            for child in plugin.children:
                child.end()
    assert said.startswith(fault) and bool(said) == bool(fault)
