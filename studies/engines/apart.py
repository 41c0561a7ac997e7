"""In a worker of a cluster: pieces are done in processes of their own.

A process that dies then costs its piece, and the worker lives to say why. What libraries read when they are loaded
(threads, portability) is given by the client, however the worker was started. And the process reads the sources
when it starts: a worker that has been up for a week does not compute with last week's code.
"""

import json
import os
import pickle
import subprocess
import sys
from collections import defaultdict
from dataclasses import dataclass
from multiprocessing import Pipe
from pathlib import Path
from threading import Lock

from studies.runs.user_code import Given, load_given
from studies.sweep.workers import PATIENCE, Death, cause_of

PROGRAM = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from studies.engines.child import main; main({})"
DONE = pickle.dumps(None)
"""Answer of a process that has begun."""


@dataclass(frozen=True)
class Setup:
    """What a process of a client's sweep needs to begin."""

    environment: tuple[tuple[str, str], ...]
    files: tuple[Given, ...]
    folder: str
    """In which the client was started."""

    def answer(self) -> None:
        """In the process: goes to that folder where there is one, so that a case finds its files, and loads the user's
        files. Raises StudyError."""
        if Path(self.folder).is_dir():
            os.chdir(self.folder)
        load_given(self.files)


class Child:
    """A process for pieces, and the line to it."""

    def __init__(self, session: str, setup: bytes) -> None:
        self.session, self.setup = session, setup
        here, there = Pipe()
        with there:
            self.process = subprocess.Popen(
                [sys.executable, "-c", PROGRAM.format(there.fileno()), json.dumps(sys.path)],
                stdin=subprocess.PIPE,
                pass_fds=(there.fileno(),),
                env=os.environ | dict(pickle.loads(setup).environment),
            )
        self.line = here

    def ask(self, request: bytes) -> bytes | Death:
        """The answer, pickled; Death where the process ended instead."""
        try:
            self.line.send_bytes(request)
            return self.line.recv_bytes()
        except (EOFError, BrokenPipeError, ConnectionResetError):
            return Death(cause_of(self.process.wait()))

    def end(self) -> None:
        """Whatever it does."""
        self.process.terminate()
        try:
            self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.line.close()
        if self.process.stdin is not None:
            self.process.stdin.close()


@dataclass(frozen=True)
class _Known:
    idle: dict[bytes, list[Child]]
    busy: set[Child]
    lock: Lock


_KNOWN = _Known(defaultdict(list), set(), Lock())


def ask(session: str, setup: bytes, request: bytes) -> bytes:
    """Has a request done (studies.engines.requests) by a process of that setup: one that waits, or a new one.

    As many are at work as the worker has threads. All is pickled, also the answer, which is a Death where the process
    died: the worker itself unpickles no type of ours, for one that it lacks would end it."""
    with _KNOWN.lock:
        idle = _KNOWN.idle[setup]
        child, begun = (idle.pop(), True) if idle else (Child(session, setup), False)
        _KNOWN.busy.add(child)
    answer = DONE if begun else child.ask(setup)
    has_begun = answer == DONE
    if has_begun:
        answer = child.ask(request)
    lives = has_begun and not isinstance(answer, Death)
    with _KNOWN.lock:
        _KNOWN.busy.discard(child)
        if lives:
            _KNOWN.idle[setup].append(child)
    if not lives:
        child.end()
    return pickle.dumps(answer) if isinstance(answer, Death) else answer


def stop(session: str) -> None:
    """Ends all processes of a client, whatever they do."""
    with _KNOWN.lock:
        idle = [child for waiting in _KNOWN.idle.values() for child in waiting if child.session == session]
        for child in idle:
            _KNOWN.idle[child.setup].remove(child)
        busy = [child for child in _KNOWN.busy if child.session == session]
    for child in busy:
        child.process.terminate()  # who waits for its answer clears up
    for child in idle:
        child.end()
