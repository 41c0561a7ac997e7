"""A sweep on the workers that a Dask scheduler knows (https://distributed.dask.org)."""

import logging
import os
import pickle
import secrets
import time
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from queue import SimpleQueue
from typing import Any, cast

from distributed import Client, Future, KilledWorker, wait
from distributed.client import FutureCancelledError, FuturesCancelledError

from studies.base.errors import StudyError
from studies.base.processes import TRIES, Died
from studies.catalog.study import Study
from studies.runs.user_code import Given, given_files
from studies.store.ledger import Ledger
from studies.sweep.engines.requests import check_for, do_job, prepare, time_study, wait_until_seen
from studies.sweep.engines.worker import JobPlugin, do, machine
from studies.sweep.executor import CompileListener, Progress
from studies.sweep.job import Job, case_jobs
from studies.sweep.local import environment, files_for

CONNECT_SECONDS = 10.0
"""After which a scheduler that does not answer is not there."""
LOOK_SECONDS = 1.0
"""Between two looks at which workers there are."""
BUSY = 0.1
"""Share of a machine's processors that others may use during frame times, without a warning."""
GONE = (
    "the Dask scheduler no longer answers: restart it and its workers; finished work is stored; run "
    "the same command to continue"
)


class Session:
    """The workers of one sweep: those that are fit."""

    def __init__(self, client: Client, patience: float) -> None:
        """patience: seconds without a fit worker that are waited."""
        self.client, self.patience = client, patience
        self.name = f"organbench-{secrets.token_hex(4)}"
        self.faults: SimpleQueue[str] = SimpleQueue()
        self.manned = time.monotonic()
        self.submitted = 0

    def workers(self) -> dict[str, Any]:
        """All workers of the scheduler now, by address. Raises StudyError when it is gone."""
        try:
            if self.client.status == "running":
                return self.client.scheduler_info(n_workers=-1)["workers"]  # some versions tell of five by default
        except OSError as error:
            raise StudyError(GONE) from error
        raise StudyError(GONE)

    def fit(self) -> dict[str, Any]:
        """Those that get jobs. Warns of those that joined unfit, and raises StudyError when there has been none for
        too long."""
        while not self.faults.empty():
            warnings.warn(f"{self.faults.get()}; it gets no job", stacklevel=2)
        fit_workers = {place: worker for place, worker in self.workers().items() if worker["resources"].get(self.name)}
        if fit_workers:
            self.manned = time.monotonic()
        elif time.monotonic() > self.manned + self.patience:
            raise StudyError(
                f"the cluster has had no worker for {self.patience:g} s: start some with `organbench worker`; finished "
                "work is stored; run the same command to continue"
            )
        return fit_workers

    def begin(self, plugin: JobPlugin) -> None:
        """Returns when all workers that are there are fit, and there is one. Raises StudyError for one that is not."""
        while not self.workers():
            self.fit()
            time.sleep(LOOK_SECONDS / 5)
        workers, specs = self.workers(), cast(dict[str, Any], self.client.run(find_spec, "studies"))
        bare = [workers[place]["name"] for place, spec in specs.items() if spec is None]
        if bare:
            raise StudyError(f"worker {bare[0]} cannot load organbench; install it there; nothing has run")
        try:
            self.client.register_plugin(plugin, name=self.name)
        except StudyError as error:
            raise StudyError(f"{error}; nothing has run") from error
        self.client.subscribe_topic(self.name, lambda event: self.faults.put(event[1]))

    def submit(self, request: Callable[[], Any], **options: Any) -> Future:
        """Has a call done by a process of a fit worker, in the order of asking."""
        self.submitted += 1
        options |= {"key": f"{self.name}-{self.submitted}", "priority": -self.submitted, "pure": False}
        return self.client.submit(do, self.name, pickle.dumps(request), resources={self.name: 1}, **options)

    def ended(self, futures: Iterable[Future]) -> list[Future]:
        """Those that have ended; waits a moment for the first."""
        with suppress(TimeoutError), self.client.as_current():
            wait(list(futures), timeout=LOOK_SECONDS, return_when="FIRST_COMPLETED")
        return [future for future in futures if future.done()]


class Cluster:
    """The executor that is a Dask cluster (studies.sweep.executor.Executor)."""

    def __init__(self, scheduler: Callable[[], AbstractContextManager[str]], patience: float, to_come: int = 1) -> None:
        """scheduler: makes its address; patience: seconds without any worker that are waited; to_come: jobs that
        workers not yet there will do at a time."""
        self.scheduler, self.patience, self.to_come = scheduler, patience, to_come
        self.stack = ExitStack()
        self.client: Client | None = None

    def __enter__(self) -> "Cluster":
        return self

    def __exit__(self, *error: object) -> None:
        self.client = None
        self.stack.close()

    @property
    def processes(self) -> int:
        """Threads of all workers that there are now."""
        threads: Any = self._connected().nthreads()
        return max(self.to_come, sum(threads.values()))

    def _connected(self) -> Client:
        if self.client is None:
            self.client = self.stack.enter_context(client_of(self.stack.enter_context(self.scheduler())))
        return self.client

    @contextmanager
    def _session(self, root: Path, files: tuple[Given, ...]) -> Iterator[Session]:
        """Inside, the workers are prepared. Raises StudyError when the scheduler is gone."""
        session = Session(self._connected(), self.patience)
        preparation = pickle.dumps(partial(prepare, os.getcwd(), files))
        try:
            with check_for(root, files) as check:
                session.begin(JobPlugin(session.name, environment(), preparation, pickle.dumps(check)))
                yield session
        except (FutureCancelledError, FuturesCancelledError) as error:
            raise StudyError(GONE) from error
        finally:
            with suppress(Exception):  # the scheduler may be gone
                session.client.unregister_worker_plugin(session.name)  # ends what is being done

    def map(self, jobs: Sequence[Job], on_compile: CompileListener) -> Generator[tuple[Job, str | None]]:
        """As every executor; what workers compile is not shown. No more jobs are with Dask than can be done at a time:
        a worker that is lost costs those a try that it had."""
        if not jobs:
            return
        waiting, running, done = deque(jobs), dict[Future, Job](), list[Path]()
        with self._session(jobs[0].root, files_for(jobs)) as session:
            while waiting or running:
                slots = sum(worker["nthreads"] for worker in session.fit().values())
                while waiting and len(running) < slots:
                    job = waiting.popleft()
                    running[session.submit(partial(do_job, job), retries=TRIES - 1)] = job
                for future in session.ended(running):
                    job, cause = running.pop(future), cause_of(future)
                    done += [job.path] if cause is None else []
                    yield job, cause
        wait_until_seen(done)

    def measure(
        self, ledger: Ledger, study: Study, progress: Progress, on_compile: CompileListener, among: set[Path] | None
    ) -> int:
        """As every executor: on one worker of each kind of machine, after all jobs, one machine after the other."""
        root = ledger.root.absolute()
        timed = [job for job in case_jobs(root, study) if job.work.timed]
        chosen = [job for job in timed if among is None or job.path in among]
        ledger.look_again()
        if not chosen or (self.client is None and all(map(ledger.timed_somewhere, chosen))):
            return 0
        cases = tuple(job.work for job in timed)
        # Charts and metrics of a user may not be there to be loaded; the cases are what is timed.
        request, count = partial(time_study, root, Study(study.name, "", cases, (), ()), among), 0
        with self._session(root, given_files(cases)) as session:
            names = {place: str(worker["name"]) for place, worker in session.fit().items()}
            kinds: Any = session.client.run(machine, session.name, workers=list(names))
            places = {kinds[place]: place for place in sorted(kinds, key=names.__getitem__, reverse=True)}
            progress.begin("timing", len(places))
            for _, place in sorted(places.items()):
                count += timed_on(session, place, names[place], request, study.name)
                progress.advance("timing", names[place])
        return count


def cause_of(future: Future) -> str | None:
    """Why a job is not done; raises what it raised."""
    try:
        error = pickle.loads(future.result())
    except Died as death:
        return f"its process died {TRIES} times: {death}"
    except KilledWorker as lost:
        return f"its worker was lost {lost.allowed_failures + 1} times"
    if error is not None:
        raise error
    return None


def timed_on(session: Session, place: str, name: str, request: Callable[[], Any], study: str) -> int:
    """How many cases of a study were timed on one worker."""
    future = session.submit(request, workers=[place])
    while not session.ended([future]):
        if place not in session.fit():
            raise StudyError(f"worker {name} was lost while it measured frame times; the same command goes on")
    try:
        count, busy = pickle.loads(future.result())
    except Died as death:
        raise StudyError(f"worker {name} measured frame times, and its process died: {death}") from death
    if count and busy > BUSY:
        warnings.warn(
            f"during the frame times of {study} other programs used {100 * busy:.0f} % of the processors of "
            f"worker {name}: the times may be too long",
            stacklevel=2,
        )
    return count


@contextmanager
def client_of(address: str) -> Iterator[Client]:
    """A client of the scheduler at `address`. Raises StudyError where there is none."""
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what goes wrong is a sentence here
    try:
        client = Client(address, timeout=CONNECT_SECONDS, set_as_default=False, name="organbench")
    except (OSError, ValueError, TypeError) as error:
        first = (str(error).splitlines() or [type(error).__name__])[0]
        raise StudyError(
            f"there is no Dask scheduler at {address} ({first}); start one with `dask scheduler`, or correct the "
            "address"
        ) from error
    try:
        yield client
    finally:
        client.close(timeout=1)
