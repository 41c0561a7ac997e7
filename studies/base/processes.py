"""Jobs in processes of their own: a process that dies costs its job a try, and the rest goes on.

Each process has a pipe of its own. The processes of `pebble.ProcessPool` share one, and a job whose process dies at
once can be lost there for ever (measured: one in 300).
"""

import multiprocessing
import os
import pickle
import signal
import threading
import traceback
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from multiprocessing.connection import Connection, wait
from typing import Any, NamedTuple

from studies.base.interrupts import die_quietly, died_of_it, held_back

TRIES = 3
"""Of a job whose process dies."""
PATIENCE = 5.0
"""Seconds that a process has to end."""
IDLE_SECONDS = 1800.0
"""Without a job, after which a process ends."""
SPAWN = multiprocessing.get_context("spawn")
STARTING = threading.Lock()
Tell = Callable[[str], object]
Begin = Callable[[Tell], object]
"""What a process does first; it may send messages."""


class Died(Exception):
    """A process ended before its job did; the text is the cause."""


class Message(NamedTuple):
    text: str


class Ended(NamedTuple):
    """A job that is over."""

    job: Any
    result: Any
    cause: str | None
    """Why it has no result: its process died in all TRIES."""


def begin_nothing(tell: Tell) -> None:
    """The `begin` of processes that need no preparation."""


class Child:
    """A process that does one job after another."""

    def __init__(self, begin: Begin = begin_nothing, environment: Mapping[str, str] | None = None) -> None:
        """environment: variables that libraries read when the process loads them."""
        self.line, there = SPAWN.Pipe()
        self.busy = False
        self.process = SPAWN.Process(target=_serve, args=(there, begin), daemon=True)
        in_main = threading.current_thread() is threading.main_thread()
        with STARTING, changed(environment or {}), held_back() if in_main else nullcontext():
            self.process.start()
        there.close()  # the process alone holds its end: when it is gone, so is the line

    @property
    def lives(self) -> bool:
        return self.process.exitcode is None

    def give(self, do: Callable[[Any], object], job: Any) -> None:
        """Sends it a job. A process that is already dead shows that when it is heard."""
        self.busy = True
        with suppress(BrokenPipeError, ConnectionResetError):
            self.line.send_bytes(pickle.dumps((do, job)))

    def hear(self) -> Any:
        """The next thing that it sends: a Message, the result of its job, or the Died in place of one.

        Raises what the job raised."""
        try:
            answer = pickle.loads(self.line.recv_bytes())
        except (EOFError, ConnectionResetError):
            self.process.join()
            return Died(cause_of(self.process.exitcode))
        self.busy = isinstance(answer, Message)
        if isinstance(answer, Exception) and not isinstance(answer, Died):
            raise answer
        return answer

    def end(self) -> None:
        """Ends the process, whatever it does: an idle one when its line closes."""
        self.line.close()
        if self.busy:
            self.process.terminate()
        self.process.join(PATIENCE)
        if self.lives:
            self.process.kill()


def run_each(
    jobs: Sequence[Any],
    processes: int,
    do: Callable[[Any], object],
    begin: Begin = begin_nothing,
    environment: Mapping[str, str] | None = None,
    tell: Tell = lambda text: None,
) -> Generator[Ended]:
    """Does `jobs` in so many processes, which call `begin` first; yields each job as it ends. `tell` gets messages.

    Raises what `do` and `begin` raise, and KeyboardInterrupt when Ctrl-C reaches a process before this one."""
    waiting, tries = deque(range(len(jobs))), Counter[int]()
    given: dict[Child, int] = {}
    idle: list[Child] = []
    try:
        while waiting or given:
            while waiting and len(given) < processes:
                child = idle.pop() if idle and idle[-1].lives else Child(begin, environment)
                given[child] = waiting.popleft()
                child.give(do, jobs[given[child]])
            for child in _ready(given):
                answer = child.hear()
                if isinstance(answer, Message):
                    tell(answer.text)
                    continue
                number = given.pop(child)
                if not isinstance(answer, Died):
                    idle.append(child)
                    yield Ended(jobs[number], answer, None)
                    continue
                child.end()
                if died_of_it(child.process.exitcode):
                    raise KeyboardInterrupt
                tries[number] += 1
                if tries[number] < TRIES:
                    waiting.append(number)
                else:
                    yield Ended(jobs[number], None, f"its process died {TRIES} times: {answer}")
    finally:
        for child in (*idle, *given):
            child.end()


def _ready(children: Iterable[Child]) -> list[Child]:
    lines = {child.line: child for child in children}
    return [lines[line] for line in wait(list(lines)) if isinstance(line, Connection)]


def _serve(line: Connection, begin: Begin) -> None:
    """In the process: does what comes along the line until that is closed, or nothing comes for long."""
    die_quietly()
    try:
        begin(lambda text: line.send_bytes(pickle.dumps(Message(text))))
    except Exception as error:  # a user's file may raise anything
        line.send_bytes(pickle.dumps(sendable(error)))
        return
    while line.poll(IDLE_SECONDS):
        try:
            message = line.recv_bytes()
        except EOFError:
            return
        line.send_bytes(_done(message))


def _done(message: bytes) -> bytes:
    try:
        do, job = pickle.loads(message)
        return pickle.dumps(do(job))
    except Exception as error:
        return pickle.dumps(sendable(error))


def sendable(error: Exception) -> Exception:
    """The error with the lines of its traceback; one that cannot be sent as a RuntimeError, MemoryError as a Died."""
    if isinstance(error, MemoryError):
        return Died("it ran out of memory")
    text = "".join(traceback.format_exception(error))
    error.add_note(text)
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # whatever its own type does
        return RuntimeError(text)
    return error


def cause_of(exit_code: int | None) -> str:
    """Why a process ended, in words."""
    if exit_code is None or exit_code >= 0:
        return f"it ended with exit code {exit_code}"
    name = signal.Signals(-exit_code).name if -exit_code in set(signal.Signals) else f"signal {-exit_code}"
    return f"killed by {name}" + (", as a system short of memory does" if exit_code == -signal.SIGKILL else "")


@contextmanager
def changed(environment: Mapping[str, str]) -> Iterator[None]:
    """Inside, this process and those that it starts have these variables."""
    before = {name: os.environ.get(name) for name in environment}
    os.environ.update(environment)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
