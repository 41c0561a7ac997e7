"""On a worker of a Dask cluster: a plugin that has its jobs done by processes, once the worker has proved fit.

Dask's own process imports nothing that computes. The processes read the code when they start, so a worker that has been
up for a week does not compute with last week's code; libraries find the variables of the client in them; and one that
dies costs its job a try, while the worker lives to say why.
"""

import asyncio
import multiprocessing
import pickle
from functools import partial
from threading import Lock
from typing import Any

from distributed import Worker, WorkerPlugin, get_worker

from studies.base.errors import StudyError
from studies.base.processes import Child, Died, Message, Tell


def do(session: str, request: bytes) -> bytes:
    """In a Dask job: has a pickled call (studies.sweep.engines.requests) done; its pickled answer. Raises Died.

    All stays pickled here: this process may lack the types."""
    return get_worker().plugins[session].do(request)  # pyright: ignore[reportAttributeAccessIssue]


def machine(session: str, dask_worker: Worker) -> str:
    """Id of the machine of a worker that is fit."""
    return dask_worker.plugins[session].machine  # pyright: ignore[reportAttributeAccessIssue]


class JobPlugin(WorkerPlugin):
    """For one client. Grants the worker the resource that every job of the client asks for, one for each thread, when
    its code, its libraries and its view of the results folder are those of the client; else it gets nothing."""

    def __init__(self, session: str, environment: dict[str, str], preparation: bytes, check: bytes) -> None:
        """preparation, check: pickled calls, done by each process first, and by one of them before any job."""
        self.session, self.environment, self.preparation, self.check = session, environment, preparation, check
        self.machine = ""

    async def setup(self, worker: Worker) -> None:
        """Raises StudyError, and sends the client an event, when the worker is not fit."""
        self.lock, self.children = Lock(), list[Child]()
        multiprocessing.current_process().daemon = False  # Dask's nanny sets it, which forbids processes of its own
        fault = await asyncio.to_thread(self.fault)
        if fault:
            worker.log_event(self.session, f"worker {worker.name} {fault}")
            raise StudyError(f"worker {worker.name} {fault}")
        await worker.set_resources(**{self.session: worker.state.nthreads})

    async def teardown(self, worker: Worker) -> None:
        """The client has ended: so do the processes, whatever they do."""
        await worker.set_resources(**{self.session: 0})
        with self.lock:
            for child in self.children:
                if child.busy:
                    child.process.terminate()  # who waits for its answer clears up
                else:
                    child.end()

    def fault(self) -> str:
        """What is wrong here: the end of a sentence that begins with the worker's name, or ""."""
        try:
            self.machine, fault = pickle.loads(self.do(self.check))
        except Died as error:
            return f"cannot start a process for organbench: {error}"
        except Exception as error:  # of the user's file, or of code that is not there
            return f"cannot begin: {(str(error) or repr(error)).splitlines()[0]}"
        return fault

    def do(self, request: bytes) -> bytes:
        """By a process that waits, or a new one."""
        with self.lock:
            self.children = [child for child in self.children if child.lives]
            child = next((child for child in self.children if not child.busy), None)
            if child is None:
                child = Child(partial(prepare, self.preparation), self.environment)
                self.children.append(child)
            child.give(answer, request)
        while isinstance(heard := child.hear(), Message):
            continue
        if isinstance(heard, Died):
            child.end()
            raise heard
        return heard


def prepare(preparation: bytes, tell: Tell) -> None:
    """In a process: what it does before any request."""
    pickle.loads(preparation)()


def answer(request: bytes) -> Any:
    """In a process: the pickled answer to a request."""
    return pickle.dumps(pickle.loads(request)())
