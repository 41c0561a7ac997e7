"""What must be so before a worker gets a piece, and what a piece declares."""

from dataclasses import replace
from pathlib import Path
from threading import Timer

import pytest

from studies.base.errors import StudyError
from studies.engines.apart import Setup
from studies.engines.checks import check_for, wait_until_seen
from studies.engines.crew import Crew
from studies.engines.fleet import Fleet
from studies.engines.identity import difference, this_identity
from studies.reference.reference_solves import ReferenceSolve
from studies.scenes.ball_squeeze import BALL_SQUEEZE
from studies.sweep.estimate import MEMORY, factor_memory
from studies.sweep.tasks import ReferenceTask
from studies.sweep.workers import Death
from tests.studies.engines.made_up import MadeUp, worker


@pytest.fixture
def check(tmp_path):
    with check_for(tmp_path, ()) as found:
        yield found


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (
            lambda ours, content: (ours, None),
            r"worker w does not see .*; put the results on a folder that every worker",
        ),
        (lambda ours, content: (ours, "older"), "worker w does not see"),
        (
            lambda ours, content: ModuleNotFoundError("No module named 'studies'"),
            r"worker w has no organbench .*'studies'",
        ),
        (lambda ours, content: Death("it ended with exit code 1"), "worker w cannot start a process .*exit code 1"),
        (lambda ours, content: StudyError("the disk is full\nand more"), "worker w cannot begin: the disk is full;"),
        (lambda ours, content: (replace(ours, packages={"numba": "0.1"}), content), "worker w has numpy not installed"),
        (lambda ours, content: (replace(ours, references=""), content), "worker w has other code"),
    ],
)
def test_what_is_wrong_with_a_worker_is_a_sentence(check, answer, told):
    lines = MadeUp(lambda address, request: answer(check.ours, check.content), w=worker("w"))
    with pytest.raises(StudyError, match=told):
        Crew(lines, Setup((), (), "."), check, Fleet([])).assemble(1.0)  # type: ignore[arg-type]


def test_modules_beside_a_file_of_the_user_are_compared(tmp_path):
    (tmp_path / "mine.py").write_text("import helper")
    (tmp_path / "helper.py").write_text("x = 1")
    given = ((str(tmp_path / "mine.py"), b"import helper"),)
    ours = this_identity(given)
    assert difference(ours, this_identity(given)) is None
    (tmp_path / "helper.py").write_text("x = 2")
    assert "has other modules beside" in str(difference(ours, this_identity(given)))


def test_a_worker_that_sees_the_folder_answers_with_what_the_file_holds(tmp_path, check):
    identity, seen = check.request.answer()
    assert check.fault("w", (identity, seen)) is None
    elsewhere = replace(check.request, token=tmp_path / "elsewhere" / "cache" / "token")
    assert elsewhere.answer()[1] is None
    assert not list(check.token.parent.glob("*.part"))


def test_files_of_other_machines_are_waited_for(tmp_path):
    late = tmp_path / "late.h5"
    Timer(0.3, late.touch).start()
    wait_until_seen([late, tmp_path], 20.0)
    with pytest.raises(StudyError, match=r"never\.h5 was written by a worker and is not seen here after 0\.2 s"):
        wait_until_seen([late, tmp_path / "never.h5"], 0.2)


@pytest.mark.parametrize(("unknowns", "peak"), [(8_191, 0.30e9), (25_423, 0.52e9), (41_851, 0.60e9), (89_598, 1.35e9)])
def test_no_less_memory_is_declared_than_references_have_taken(unknowns, peak):
    assert peak < MEMORY + factor_memory(unknowns) < 1.9 * peak


def test_the_size_of_a_reference_is_declared_before_it_is_known():
    for level, unknowns in ((0.12, 16_482), (0.22, 4_391)):
        needs = ReferenceTask(Path("nowhere"), "tiny", ReferenceSolve(BALL_SQUEEZE, level)).needs
        assert factor_memory(unknowns) <= needs - MEMORY < 3.5 * factor_memory(unknowns)
