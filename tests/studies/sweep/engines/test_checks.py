"""Conditions that a worker meets before it gets a job, and the memory that a job declares."""

import os
import pickle
from dataclasses import replace
from pathlib import Path
from threading import Timer

import pytest

from studies.base.errors import StudyError
from studies.reference.reference_solves import ReferenceSolve
from studies.scene.scene import ReferencePlan, Scene
from studies.sweep.engines.cluster import Session
from studies.sweep.engines.requests import Check, Preparation, check_for, identity, wait_until_seen
from studies.sweep.engines.worker import MEGABYTES, JobPlugin
from studies.sweep.estimate import MEMORY, factor_memory
from studies.sweep.job import ReferenceJob
from tests.studies.octant import SCENE


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


@pytest.mark.parametrize(("unknowns", "peak"), [(8_191, 0.30e9), (25_423, 0.52e9), (41_851, 0.60e9), (89_598, 1.35e9)])
def test_no_less_memory_is_declared_than_references_have_taken(unknowns, peak):
    assert peak < MEMORY + factor_memory(unknowns) < 1.9 * peak


def octant(finest: float) -> Scene:
    """The squeezed ball, which nobody published with these checkpoints, on meshes up to that."""
    return replace(SCENE, reference=ReferencePlan("octant", (0.5, finest)))


class Small(Session):
    """Workers with 500 MB at most."""

    def __init__(self):
        self.client = None

    def fit(self):
        return {"a": {"resources": {MEGABYTES: 200.0}}, "b": {"resources": {MEGABYTES: 500.0}}}


def test_a_job_that_no_worker_has_the_memory_for_is_refused_before_anything_runs():
    large = ReferenceJob(Path("results"), "tiny", ReferenceSolve(octant(0.1)))
    Small().check_memory([large, large], [499.0, 100.0])
    with pytest.raises(StudyError, match=r"reference ball_squeeze needs about 0\.6 GB, and the largest .* 0\.5"):
        Small().check_memory([large, large], [499.0, 600.0])


def test_the_size_of_a_reference_is_estimated_before_it_is_solved():
    for level, unknowns in ((0.12, 16_482), (0.22, 4_391)):
        needs = ReferenceJob(Path("nowhere"), "tiny", ReferenceSolve(octant(level))).needs
        assert factor_memory(unknowns) <= needs - MEMORY < 3.5 * factor_memory(unknowns)


def test_the_size_of_nested_meshes_is_that_of_the_plan():
    """Its most, and a fifth for the last step."""
    work = ReferenceSolve(replace(SCENE, reference=ReferencePlan(most=40e3)))
    assert ReferenceJob(Path("nowhere"), "tiny", work).needs == MEMORY + factor_memory(1.2 * 40e3)
