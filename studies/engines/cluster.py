"""A sweep on the workers of a cluster (studies.sweep.engine.Engine)."""

import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path

from studies.base.errors import StudyError
from studies.catalog.study import Study
from studies.engines.apart import Setup
from studies.engines.checks import check_for, wait_until_seen
from studies.engines.crew import Crew
from studies.engines.dask import LOST, Answer, Lines, Lost, lines_to
from studies.engines.fleet import GB, Fleet
from studies.engines.requests import FrameTimes, Piece
from studies.store.ledger import Ledger
from studies.sweep.engine import Progress, Told
from studies.sweep.own_files import Given, given_files
from studies.sweep.pool import environment
from studies.sweep.tasks import CaseTask, Task, case_tasks
from studies.sweep.workers import TRIES, Death

ANSWER_SECONDS = 0.5
"""That an answer is waited for before the workers are looked at again."""
BUSY = 0.1
"""Share of a machine's processors that others may use beside frame times, without a warning."""


class Cluster:
    """An engine: workers that a Dask scheduler knows."""

    def __init__(
        self,
        scheduler: Callable[[], AbstractContextManager[str]],
        patience: float,
        portable: bool = False,
        to_come: int = 1,
    ) -> None:
        """scheduler: makes its address; patience: seconds without any worker that are waited; to_come: pieces that
        workers not yet there will do at a time."""
        self.scheduler, self.patience, self.portable, self.to_come = scheduler, patience, portable, to_come
        self.stack = ExitStack()
        self.lines: Lines | None = None

    def __enter__(self) -> "Cluster":
        return self

    def __exit__(self, *error: object) -> None:
        self.lines = None
        self.stack.close()

    @property
    def processes(self) -> int:
        """Threads of all workers that there are now."""
        with told():
            return max(self.to_come, sum(worker.threads for worker in self._connected().workers().values()))

    def _connected(self) -> Lines:
        if self.lines is None:
            self.lines = self.stack.enter_context(lines_to(self.stack.enter_context(self.scheduler())))
        return self.lines

    def perform(
        self,
        tasks: Sequence[Task],
        progress: Progress,
        on_compile: Told,
        on_death: Callable[[Task, str], object],
    ) -> None:
        """As every engine; what workers compile is not told."""
        if not tasks:
            return
        files = given_files(task.work for task in tasks if isinstance(task, CaseTask))
        with told(), self._crew(tasks[0].root, tasks, files, self.portable) as crew:
            self._check_memory(crew.fleet)
            progress.begin("physics", len(tasks))
            done = []
            for task, cause in self._ended(crew):
                if cause is not None:
                    on_death(task, cause)
                else:
                    done.append(task.path())
                progress.advance("physics", task.label)
        wait_until_seen(done)

    @contextmanager
    def _crew(self, root: Path, tasks: Sequence[Task], files: tuple[Given, ...], portable: bool) -> Iterator[Crew]:
        lines = self._connected()
        setup = Setup(tuple(sorted(environment(portable).items())), files, os.getcwd())
        with check_for(root, files) as check:
            crew = Crew(lines, setup, check, Fleet(tasks))
            crew.assemble(self.patience)
            yield crew

    def _ended(self, crew: Crew) -> Iterator[tuple[Task, str | None]]:
        """Each piece as it ends, with None, or with a cause where it cost too many processes."""
        fleet = crew.fleet
        while fleet.left:
            for number in crew.look():
                yield from self._died(fleet, "", number, LOST)
            crew.alive(self.patience)
            for address, number in fleet.handed_out():
                crew.send(address, Piece(fleet.tasks[number]), number)
            if not any(member.busy for member in fleet.members.values()):
                self._check_memory(fleet)
            answer = crew.lines.next_answer(ANSWER_SECONDS)
            if answer is not None:
                yield from self._taken(crew, answer)

    def _taken(self, crew: Crew, answer: Answer) -> Iterator[tuple[Task, str | None]]:
        if not isinstance(answer.label, int):
            crew.checked(answer)
        elif isinstance(answer.value, Death):
            yield from self._died(crew.fleet, answer.address, answer.label, answer.value.cause)
        elif isinstance(answer.value, Exception):
            raise answer.value
        else:
            crew.fleet.done(answer.address, answer.label)
            yield crew.fleet.tasks[answer.label], None

    def _died(self, fleet: Fleet, address: str, number: int, cause: str) -> Iterator[tuple[Task, str | None]]:
        if fleet.died(address, number):
            yield fleet.tasks[number], f"its process died {TRIES} times: {cause}"

    def _check_memory(self, fleet: Fleet) -> None:
        """Raises StudyError when a piece needs more memory than any worker has."""
        found = fleet.too_large()
        if found is None or not fleet.members:
            return
        task, need = found
        most = max(member.memory for member in fleet.members.values())
        raise StudyError(
            f"{task.label} needs about {need / GB:.1f} GB, and the largest worker has {most / GB:.1f} GB: start one "
            "with more (`organbench worker --memory`)"
        )

    def measure(self, root: Path, study: Study, progress: Progress, on_compile: Told, among: set[Path] | None) -> int:
        """As every engine: on one worker of each kind of machine, after all pieces, one machine after the other."""
        ledger, timed = Ledger(root), [task for task in case_tasks(root, study) if task.work.timed]
        cases, chosen = tuple(task.work for task in timed), [t for t in timed if among is None or t.path() in among]
        if not chosen or (self.lines is None and all(map(ledger.timed_somewhere, chosen))):
            return 0
        request = FrameTimes(root, study.name, cases, None if among is None else frozenset(among))
        with told(), self._crew(root, [], given_files(cases), portable=False) as crew:
            machines = list(crew.machines())
            progress.begin("timing", len(machines))
            return sum(self._timed(crew, machine[0].address, request, progress) for machine in machines)

    def _timed(self, crew: Crew, address: str, request: FrameTimes, progress: Progress) -> int:
        """On one worker; how many cases that were."""
        name = crew.fleet.members[address].name
        crew.send(address, request, 0)
        while True:
            if address not in crew.names:
                raise StudyError(f"worker {name} was lost while it measured frame times; the same command goes on")
            crew.look()
            answer = crew.lines.next_answer(ANSWER_SECONDS)
            if answer is None or answer.label != 0:
                continue
            if isinstance(answer.value, Death):
                raise StudyError(f"worker {name} measured frame times, and its process died: {answer.value.cause}")
            if isinstance(answer.value, Exception):
                raise answer.value
            count, busy = answer.value
            if count and busy > BUSY:
                warnings.warn(
                    f"beside the frame times of {request.study} others used {100 * busy:.0f} % of the processors of "
                    f"worker {name}: take them with care",
                    stacklevel=2,
                )
            progress.advance("timing", name)
            return count


@contextmanager
def told() -> Iterator[None]:
    """Inside, a scheduler that is lost is one sentence."""
    try:
        yield
    except Lost as error:
        raise StudyError(
            "the Dask scheduler is gone, or no longer answers: start it and its workers again; what is finished is "
            "stored, the same command goes on from there"
        ) from error
