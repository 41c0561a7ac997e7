"""A reference that cannot be meshed costs its scene, not the study."""

import pytest

from studies.base.errors import StudyError
from studies.reference.reference_solves import reference_solves
from studies.scenes import BALL_CLAMPED
from studies.store.record import Status, peek
from studies.sweep import pool
from studies.sweep.tasks import Task


def test_a_mesh_that_cannot_be_made_is_stored_as_failed_with_its_reason(tmp_path, monkeypatch):
    def refuse(root, solve):
        raise StudyError("ball: use more nodes")

    monkeypatch.setattr(pool, "solve", refuse)
    task = Task(tmp_path, "made_up", reference_solves(BALL_CLAMPED)[0])
    stored = peek(pool.do(task))
    assert (stored.status, stored.message) == (Status.FAILED, "ball: use more nodes")
    assert task.is_current()


def test_a_result_that_cannot_be_stored_ends_the_sweep(tmp_path, monkeypatch):
    def full(*_):
        raise StudyError("no space is left")

    monkeypatch.setattr(pool, "solve", full)
    monkeypatch.setattr(pool, "store_failure", full)
    with pytest.raises(StudyError, match="no space is left"):
        pool.do(Task(tmp_path, "made_up", reference_solves(BALL_CLAMPED)[0]))
