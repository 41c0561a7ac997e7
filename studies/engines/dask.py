"""A Dask cluster, whoever made it, as the engine of a sweep (https://distributed.dask.org).

Dask carries requests to workers and answers back. Which worker gets which piece is decided here, for Dask gives work to
a worker the moment it appears, before its code could be compared, and does a finished piece again when the worker that
keeps its answer is gone.
"""

import logging
import pickle
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

from distributed import Client, Future, KilledWorker
from distributed.client import FutureCancelledError

from studies.base.errors import StudyError
from studies.engines.apart import Setup
from studies.engines.requests import Request
from studies.sweep.workers import Death

CONNECT_SECONDS = 10.0
"""After which a scheduler that does not answer is not there."""
TRANSFER_SECONDS = 30.0
"""That an answer may take from its worker to here."""
ASK = "__import__('studies.engines.apart', fromlist=['ask']).ask(session, setup, request)"
STOP = "__import__('studies.engines.apart', fromlist=['stop']).stop(session)"
"""What workers evaluate. A function of organbench itself would end a worker that has none, without a word."""
LOST = "its worker was lost"
"""A cause of death."""


@dataclass(frozen=True)
class Found:
    """A worker as the scheduler knows it."""

    name: str
    threads: int
    memory: float
    """Its limit [bytes]; 0 without one."""


@dataclass(frozen=True)
class Answer:
    """What came of a request."""

    label: Any
    """Given with the request."""
    address: str
    """Of the worker."""
    value: Any
    """Whatever the request answers; a Death, or the exception that was raised."""


class Lost(Exception):
    """The scheduler is gone."""


class Lines:
    """Requests to the workers of a scheduler, and their answers."""

    def __init__(self, client: Client, session: str) -> None:
        self.client, self.session = client, session
        self.flying: dict[str, tuple[Future, Any, str]] = {}
        self.ended: SimpleQueue[str] = SimpleQueue()
        self.sent = 0

    def workers(self) -> dict[str, Found]:
        """Those that the scheduler knows now, by address. Raises Lost."""
        if self.client.status != "running":
            raise Lost
        try:
            known = self.client.scheduler_info()["workers"]
        except OSError as error:
            raise Lost from error
        return {
            address: Found(str(worker["name"]), int(worker["nthreads"]), float(worker["memory_limit"] or 0))
            for address, worker in known.items()
        }

    def send(self, address: str, setup: Setup, request: Request, label: Any) -> None:
        """A request for one worker, which no other will get."""
        self.sent += 1
        key = f"organbench-{self.session}-{self.sent}"
        given = {"session": self.session, "setup": pickle.dumps(setup), "request": pickle.dumps(request)}
        future = self.client.submit(eval, ASK, given, key=key, workers=[address], allow_other_workers=False, pure=False)
        self.flying[key] = future, label, address
        future.add_done_callback(lambda future: self.ended.put(future.key))

    def drop(self, address: str) -> None:
        """What a worker that is gone was asked will not be answered."""
        for key in [key for key, (_, _, asked) in self.flying.items() if asked == address]:
            self.flying.pop(key)[0].cancel()

    def next_answer(self, seconds: float) -> Answer | None:
        """The next answer, None when none comes in so many seconds. Raises Lost."""
        try:
            key = self.ended.get(timeout=seconds)
        except Empty:
            return None
        if key not in self.flying:
            return None
        future, label, address = self.flying.pop(key)
        return Answer(label, address, self._value(future))

    def _value(self, future: Future) -> Any:
        try:
            answer = future.result(timeout=TRANSFER_SECONDS)
        except FutureCancelledError as error:
            raise Lost from error
        except (KilledWorker, TimeoutError):
            return Death(LOST)
        except Exception as error:  # of Dask itself, or of a worker that has no organbench
            return error
        return pickle.loads(answer)

    def close(self) -> None:
        """Ends what is still being done, and the processes on all workers."""
        for future, _, _ in self.flying.values():
            with suppress(Exception):  # the scheduler may be gone
                future.cancel()
        self.flying.clear()
        if self.client.status == "running":
            with suppress(Exception):
                self.client.run(eval, STOP, {"session": self.session}, on_error="ignore")


@contextmanager
def lines_to(address: str) -> Iterator[Lines]:
    """Requests to the workers of the scheduler at `address`; at the end they have no process of ours.

    Raises StudyError where there is no scheduler."""
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what goes wrong is said here, in a sentence
    try:
        client = Client(address, timeout=CONNECT_SECONDS, set_as_default=False, name="organbench")
    except (OSError, ValueError, TypeError) as error:
        raise StudyError(
            f"there is no Dask scheduler at {address} ({_first_line(error)}); start one with `dask scheduler`, or "
            "correct the address"
        ) from error
    lines = Lines(client, secrets.token_hex(8))
    try:
        yield lines
    finally:
        lines.close()
        client.close(timeout=1)


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
