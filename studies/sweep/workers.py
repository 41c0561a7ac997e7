"""Processes that do pieces of work, each one at a time: one that dies costs the piece that it had, and is replaced."""

import multiprocessing
import pickle
import signal
import traceback
from collections import Counter, deque
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from studies.base.interrupts import died_of_it, held_back

TRIES = 3
"""Of a piece whose process dies: once, and twice again."""
PATIENCE = 5.0
"""Seconds that a process is given to end."""


@dataclass(frozen=True)
class Death:
    """Why a process could not go on with a piece."""

    cause: str


@dataclass
class Worker:
    """A process, the line to it, and the piece that it has."""

    process: BaseProcess
    line: Connection
    task: Any = None

    def give(self, task: Any) -> None:
        """Sends it a piece. One that died before it got the piece shows it when its answer is read."""
        self.task = task
        try:
            self.line.send(task)
        except (BrokenPipeError, ConnectionResetError):
            return

    def answer(self) -> Death | None:
        """What came of its piece: None when it is done. Raises what the piece raised; KeyboardInterrupt where the
        process was ended by Ctrl-C, for this process is about to hear of it too."""
        try:
            told = self.line.recv()
        except (EOFError, ConnectionResetError):
            self.process.join()
            if died_of_it(self.process.exitcode):
                raise KeyboardInterrupt from None
            return Death(cause_of(self.process.exitcode))
        if isinstance(told, BaseException):
            raise told
        return told

    def end(self) -> None:
        """Idle, it ends by itself when the line is closed; busy, it is told to."""
        self.line.close()
        if self.task is not None:
            self.process.terminate()
        self.process.join(PATIENCE)


def done_or_dead(
    tasks: Sequence[Any], jobs: int, do: Callable[[Any], object], begin: Callable[[], None]
) -> Generator[tuple[Any, str | None]]:
    """Does `tasks` in so many processes, which call `begin` first. Yields each as it ends, with None, or with a cause
    where its process died in all TRIES. Raises what `do` raises."""
    waiting, tries = deque(enumerate(tasks)), Counter[int]()
    workers = [started(do, begin) for _ in range(min(jobs, len(tasks)))]
    try:
        for worker in workers:
            worker.give(waiting.popleft())
        while busy := [worker for worker in workers if worker.task is not None]:
            for worker in answered(busy):
                (number, task), death = worker.task, worker.answer()
                worker.task = None
                if death is not None:
                    worker.end()
                    workers[workers.index(worker)] = worker = started(do, begin)
                    tries[number] += 1
                if death is None or tries[number] == TRIES:
                    yield task, death and f"its process died {TRIES} times: {death.cause}"
                else:
                    waiting.append((number, task))
                if waiting:
                    worker.give(waiting.popleft())
    finally:
        for worker in workers:
            worker.end()


def answered(busy: Sequence[Worker]) -> list[Worker]:
    """Those that have something to tell, or have died."""
    ready = wait([worker.line for worker in busy])
    return [worker for worker in busy if worker.line in ready]


def started(do: Callable[[Any], object], begin: Callable[[], None]) -> Worker:
    """A new process."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=serve, args=(there, do, begin), daemon=True)
    with held_back():
        process.start()
    there.close()  # its end is held by the process alone: when that ends, so does the line
    return Worker(process, here)


def serve(line: Connection, do: Callable[[Any], object], begin: Callable[[], None]) -> None:
    """In the process: does what comes along the line, until it is closed."""
    try:
        begin()
        while True:
            do(line.recv()[1])
            line.send(None)
    except EOFError:
        return
    except MemoryError:
        line.send(Death("it ran out of memory"))
    except Exception as error:
        line.send(sendable(error))


def sendable(error: Exception) -> Exception:
    """The error, with the lines of its traceback here; an error of an unusual type as one that can be sent."""
    error.add_note("".join(traceback.format_exception(error)))
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # whatever its own type does
        return RuntimeError("".join(traceback.format_exception(error)))
    return error


def cause_of(exit_code: int | None) -> str:
    """Why a process ended, in words."""
    if exit_code is None or exit_code >= 0:
        return f"it ended with exit code {exit_code}"
    name = signal.Signals(-exit_code).name if -exit_code in set(signal.Signals) else f"signal {-exit_code}"
    return f"killed by {name}" + (", as a system short of memory does" if exit_code == -signal.SIGKILL else "")
