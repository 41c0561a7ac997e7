"""What the processes of a test run share: made once, by one of them, and never seen half made."""

import threading
import time

import pytest

from tests.conftest import locked, once_per_run


def test_two_that_ask_at_once_get_what_one_makes(tmp_path):
    folders, contents = [], []

    def make(folder):
        folders.append(folder)
        time.sleep(0.2)
        (folder / "file").write_text("whole")

    def ask():
        contents.append((once_per_run(tmp_path, "thing", make) / "file").read_text())

    threads = [threading.Thread(target=ask) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(folders) == 1 and contents == ["whole"] * 3


def test_what_fails_leaves_nothing_and_is_tried_again(tmp_path):
    def fails(folder):
        (folder / "half").write_text("half")
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        once_per_run(tmp_path, "thing", fails)
    assert not list((once_per_run(tmp_path, "thing", lambda folder: None)).iterdir())


def test_a_lock_that_is_never_given_is_named(tmp_path):
    (tmp_path / "thing.lock").touch()
    with (
        pytest.raises(pytest.fail.Exception, match=r"thing\.lock was held for 0\.1 s"),
        locked(tmp_path / "thing.lock", 0.1),
    ):
        pass
