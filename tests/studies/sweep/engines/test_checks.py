"""Conditions that a worker meets before it gets a job."""

import os
import pickle
from dataclasses import replace
from pathlib import Path
from threading import Timer

import pytest

from studies.base.errors import StudyError
from studies.sweep.engines.requests import Check, Preparation, check_for, identity, wait_until_seen
from studies.sweep.engines.worker import JobPlugin


@pytest.fixture
def check(tmp_path):
    with check_for(tmp_path, ()) as made:
        yield made


def test_a_worker_like_this_one_is_fit(check):
    _, fault = check.answer()
    assert fault == ""
    assert [path.name for path in check.token.parent.iterdir()] == [check.token.name], "no trial is left"


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"content": "older"}, r"does not see .*; put the results on a folder that every worker shares"),
        ({"token": Path("elsewhere/cache/token")}, "does not see elsewhere; "),
        ({"numba": "0.1"}, r"has numba [\d.]+, and this machine has 0\.1; install the same version there"),
        ({"Python": "3.9"}, r"has Python 3\.\d+\.\d+, and this machine has 3\.9"),
        ({"the code of organbench": "0"}, "differs in the code of organbench; put the same version there"),
    ],
)
def test_what_is_wrong_with_a_worker_is_a_sentence(check, change, fault):
    versions = {name: value for name, value in change.items() if name in check.ours}
    fields = {name: value for name, value in change.items() if name not in check.ours}
    with pytest.raises(StudyError, match=fault):
        raise StudyError(replace(check, ours=check.ours | versions, **fields).answer()[1])


def test_modules_next_to_a_file_of_the_user_are_compared(tmp_path, check):
    (tmp_path / "mine.py").write_text("import helper")
    (tmp_path / "helper.py").write_text("x = 1")
    given = ((str(tmp_path / "mine.py"), b"import helper"),)
    ours = replace(check, ours=identity(given), files=given)
    assert ours.fault() == ""
    (tmp_path / "helper.py").write_text("x = 2")
    assert ours.fault().startswith(f"differs in the modules next to {tmp_path / 'mine.py'}")


class Deadly(Check):
    """A check that ends its process."""

    def answer(self):
        os._exit(3)


@pytest.mark.parametrize(
    ("files", "kind", "fault"),
    [
        ((), Deadly, "cannot start a process for organbench: it ended with exit code 3"),
        ((("mine.py", b"import nowhere"),), Check, r"cannot begin: mine\.py cannot be loaded: .*nowhere"),
    ],
)
def test_a_worker_whose_process_fails_is_unfit(check, tmp_path, files, kind, fault):
    (tmp_path / "mine.py").write_bytes(b"import nowhere")
    task = kind(check.token, check.content, check.ours, ())
    plugin = JobPlugin("session", {}, pickle.dumps(Preparation(str(tmp_path), files)), pickle.dumps(task))
    plugin.begin()
    try:
        with pytest.raises(StudyError, match=fault):
            raise StudyError(plugin.fault())
    finally:
        plugin.end()


def test_files_of_other_machines_are_waited_for(tmp_path):
    late = tmp_path / "late.h5"
    Timer(0.3, late.touch).start()
    wait_until_seen([late, tmp_path], 20.0)
    with pytest.raises(StudyError, match=r"never\.h5 was written by a worker and is not seen here after 0\.2 s"):
        wait_until_seen([late, tmp_path / "never.h5"], 0.2)
