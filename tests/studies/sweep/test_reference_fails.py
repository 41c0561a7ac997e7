"""A reference that cannot be meshed costs its scene, not the study."""

import pytest

from studies.base.errors import StudyError
from studies.reference.reference_solves import reference_solves
from studies.scenes import BALL_CLAMPED
from studies.store.ledger import Ledger
from studies.store.record import Status, peek
from studies.sweep import tasks


def test_a_mesh_that_cannot_be_made_is_stored_as_failed_with_its_reason(tmp_path, monkeypatch):
    def refuse(root, solve):
        raise StudyError("ball: use more nodes")

    monkeypatch.setattr(tasks, "solve", refuse)
    task = tasks.ReferenceTask(tmp_path, "made_up", reference_solves(BALL_CLAMPED)[0])
    stored = peek(tasks.do(task))
    assert (stored.status, stored.message) == (Status.FAILED, "ball: use more nodes")
    assert Ledger(tmp_path).why(task) is None


def test_a_result_that_cannot_be_stored_ends_the_sweep(tmp_path, monkeypatch):
    def full(*_):
        raise StudyError("no space is left")

    monkeypatch.setattr(tasks, "solve", full)
    monkeypatch.setattr(tasks, "write_record", full)
    with pytest.raises(StudyError, match="no space is left"):
        tasks.do(tasks.ReferenceTask(tmp_path, "made_up", reference_solves(BALL_CLAMPED)[0]))
