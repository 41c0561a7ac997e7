"""The processes of a worker: a fit one answers, one that fails is a sentence."""

import os
import pickle
from functools import partial
from threading import Lock

import pytest

from studies.sweep.engines.requests import check_for, prepare
from studies.sweep.engines.worker import JobPlugin


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
