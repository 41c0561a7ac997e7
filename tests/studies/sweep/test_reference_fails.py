"""A reference that cannot be meshed costs its scene, not the study."""

from dataclasses import replace

import pytest

from studies.base.errors import StudyError
from studies.reference.reference_solves import reference_solves
from studies.scene.library import BALL_CLAMPED
from studies.store.ledger import Ledger
from studies.store.record import Status, peek
from studies.sweep.job import ReferenceJob, do

SCENE = replace(BALL_CLAMPED, checkpoints=(1.0,))
"""Nobody published its reference."""


def test_a_mesh_that_cannot_be_made_is_stored_as_failed_with_its_reason(tmp_path, monkeypatch):
    def refuse(root, solve):
        raise StudyError("ball: use more nodes")

    monkeypatch.setattr("studies.reference.solve.solve", refuse)
    job = ReferenceJob(tmp_path, "made_up", reference_solves(SCENE)[0])
    stored = peek(do(job))
    assert (stored.status, stored.message) == (Status.FAILED, "ball: use more nodes")
    assert Ledger(tmp_path).why(job) is None


def test_a_result_that_cannot_be_stored_ends_the_sweep(tmp_path, monkeypatch):
    def full(*_):
        raise StudyError("no space is left")

    monkeypatch.setattr("studies.reference.solve.solve", full)
    monkeypatch.setattr("studies.sweep.job.write_record", full)
    with pytest.raises(StudyError, match="no space is left"):
        do(ReferenceJob(tmp_path, "made_up", reference_solves(SCENE)[0]))
