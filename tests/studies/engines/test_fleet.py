"""Which worker gets what, without a cluster: workers are made up, and answer at once."""

from dataclasses import replace
from pathlib import Path

import pytest

from studies.base.errors import StudyError
from studies.engines import crew as crew_module
from studies.engines.apart import Setup
from studies.engines.checks import check_for
from studies.engines.cluster import Cluster
from studies.engines.crew import Crew
from studies.engines.fleet import Fleet, Member
from studies.engines.requests import Piece, Presence
from studies.reference.reference_solves import ReferenceSolve
from studies.scenes.ball_squeeze import BALL_SQUEEZE
from studies.sweep.estimate import MEMORY
from studies.sweep.tasks import CaseTask, ReferenceTask
from studies.sweep.workers import Death
from tests.studies.engines.made_up import MadeUp, worker
from tests.studies.tiny import tiny_case

SETUP = Setup((), (), ".")


def small(number):
    """A piece of which only the number counts."""
    return CaseTask(Path("results"), "tiny", tiny_case(dt_fraction=0.5 - 0.01 * number))


def large():
    """The piece with the most memory of a reference."""
    return ReferenceTask(Path("results"), "tiny", ReferenceSolve(BALL_SQUEEZE, 0.1))


@pytest.fixture(autouse=True)
def looks_all_the_time(monkeypatch):
    monkeypatch.setattr(crew_module, "LOOK_SECONDS", 0.0)


@pytest.fixture
def check(tmp_path):
    with check_for(tmp_path, ()) as found:
        yield found


def as_it_should(check):
    """A worker without fault, that does every piece."""
    return lambda address, request: (check.ours, check.content) if isinstance(request, Presence) else "done"


def crew_of(lines, check, tasks):
    found = Crew(lines, SETUP, check, Fleet(tasks))
    found.assemble(1.0)
    return found


def ended(crew, then=lambda task: None):
    """What became of the pieces: label -> cause."""
    engine, found = Cluster(lambda: None, 0.5), {}  # type: ignore[arg-type]
    for task, cause in engine._ended(crew):
        found[task.label] = cause
        then(task)
    return found


def test_every_piece_goes_to_one_worker(check):
    lines = MadeUp(as_it_should(check), a=worker("a"), b=worker("b", threads=2))
    crew = crew_of(lines, check, [small(n) for n in range(7)])
    assert [address for address, _ in crew.fleet.handed_out()] == ["a", "b", "b"], "as many at a time as threads"
    crew = crew_of(lines, check, [small(n) for n in range(7)])
    assert len(ended(crew)) == 7 and crew.fleet.left == 0


def test_memory_is_shared_by_what_a_worker_does():
    fleet = Fleet([large(), large(), small(1)])
    need = large().needs
    fleet.members["a"] = Member("a", "a", "m", 4, need + MEMORY)
    assert [number for _, number in fleet.handed_out()] == [0, 2], "the second reference waits, the case does not"
    fleet.done("a", 0)
    assert [number for _, number in fleet.handed_out()] == [1]


def test_a_piece_that_no_worker_has_the_memory_for_is_refused_before_anything_runs(check):
    lines = MadeUp(as_it_should(check), a=worker("a", memory=2 * MEMORY), b=worker("b", memory=MEMORY))
    crew = crew_of(lines, check, [large(), small(1)])
    with pytest.raises(
        StudyError, match=r"reference ball_squeeze-0\.1 needs about \d+\.\d GB, and the largest worker has 0\.6"
    ):
        Cluster(lambda: None, 1.0)._check_memory(crew.fleet)  # type: ignore[arg-type]
    assert all(isinstance(request, Presence) for _, request in lines.sent)


def test_a_worker_that_leaves_costs_a_try_and_a_third_the_piece(check):
    def value(address, request):
        if isinstance(request, Presence):
            return check.ours, check.content
        return None if request.task == small(1) else "done"

    lines = MadeUp(value, **{name: worker(name) for name in "abcd"})
    crew = crew_of(lines, check, [small(1), small(2)])
    assert ended(crew) == {small(1).label: "its process died 3 times: its worker was lost", small(2).label: None}
    assert len(lines.known) == len(crew.fleet.members) == 1, "three are gone"


def test_a_worker_that_leaves_before_it_is_checked_is_forgotten(check):
    def value(address, request):
        if address == "hasty":
            return None
        return (check.ours, check.content) if isinstance(request, Presence) else "done"

    crew = crew_of(MadeUp(value, hasty=worker("hasty"), a=worker("a")), check, [small(1)])
    assert ended(crew) == {small(1).label: None} and not crew.checking


def test_a_sweep_whose_workers_are_all_gone_says_so(check):
    lines = MadeUp(lambda address, request: (check.ours, check.content) if isinstance(request, Presence) else None)
    lines.known = {"a": worker("a")}
    crew = crew_of(lines, check, [small(1)])
    with pytest.raises(StudyError, match=r"has had no worker for 0\.5 s.*the same command goes on from there"):
        ended(crew)


def test_a_worker_with_other_code_is_told_of_before_anything_runs(check):
    other = replace(check.ours, runs="0")
    lines = MadeUp(lambda address, request: (other, check.content), one=worker("one"))
    with pytest.raises(StudyError, match=r"worker one has other code of organbench; .* nothing has run"):
        crew_of(lines, check, [small(1)])
    assert len(lines.sent) == 1


def test_a_worker_that_joins_later_with_other_code_gets_nothing(check):
    def value(address, request):
        if isinstance(request, Presence):
            return (check.ours if address == "a" else replace(check.ours, python="3.9")), check.content
        lines.known["late"] = worker("late")
        return "done"

    lines = MadeUp(value, a=worker("a"))
    crew = crew_of(lines, check, [small(n) for n in range(4)])
    with pytest.warns(UserWarning, match=r"worker late has Python 3\.9, and here is .*; it gets no piece") as told:
        assert len(ended(crew)) == 4
    assert len(told) == 1
    assert {address for address, request in lines.sent if isinstance(request, Piece)} == {"a"}


def test_a_worker_that_joins_later_gets_pieces(check):
    def value(address, request):
        if isinstance(request, Presence):
            return check.ours, check.content
        lines.known["late"] = worker("late")
        return "done"

    lines = MadeUp(value, a=worker("a"))
    ended(crew_of(lines, check, [small(n) for n in range(6)]))
    assert {address for address, request in lines.sent if isinstance(request, Piece)} == {"a", "late"}


def test_a_process_that_dies_is_tried_three_times(check):
    def value(address, request):
        if isinstance(request, Presence):
            return check.ours, check.content
        return Death("killed") if request.task == small(1) else "done"

    lines = MadeUp(value, a=worker("a"))
    causes = ended(crew_of(lines, check, [small(n) for n in range(3)]))
    assert causes == {small(0).label: None, small(1).label: "its process died 3 times: killed", small(2).label: None}
    assert sum(request == Piece(small(1)) for _, request in lines.sent) == 3
