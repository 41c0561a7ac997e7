"""The content of a results folder, a line per file: the one place that says whether a result is there and current.

The lines lie in results/cache/ledger.sqlite. They are a copy of the heads of the files: a line is read again when the
size, a time or the inode of its file differs, and the whole ledger may be deleted at any time. A ledger that is damaged
or of another layout is replaced; where none can be written, the lines are kept in memory.
"""

import json
import os
import sqlite3
import warnings
import weakref
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from studies.base.atomic import is_there
from studies.base.errors import StudyError
from studies.store.entry import Entry, file_state, read_entry, why_entry_is_stale
from studies.store.machine import machine_id
from studies.store.paths import SUFFIX, TIMING, index_path, study_folder, timing_name
from studies.store.record import SCHEMA
from studies.store.schema import Status

TABLES = (
    f"files (study, {', '.join(Entry._fields)}, PRIMARY KEY (study, file))",
    "measured (study, what, file, state, value, PRIMARY KEY (study, what, file))",
)
LAYOUT = zlib.crc32(f"{SCHEMA} {TABLES}".encode()) >> 1
"""Number of the layout: another one for other columns or records."""
PATIENCE = 20.0
"""Seconds to wait for another command that holds the ledger; a write takes some hundredths."""
BATCH = 500
"""Files after which the lines read so far are stored, so that an interrupted command need not begin again."""
MANY = 100
"""Files from which on a warning says that the ledger cannot be stored."""
SETS = 4
"""Sets of measured values that are kept for a folder."""
FAILURES = (Status.FAILED, Status.NOT_CONVERGED, Status.TIMED_OUT)
"""Endings that another run may improve."""
TIMED = (Status.OK, Status.INVERTED, Status.DRIFTED)
"""Endings with comparable frames: the run did not break off."""


class Result(Protocol):
    """The properties of a job by which the ledger finds its result."""

    @property
    def path(self) -> Path:
        """The path of its record."""
        ...

    @property
    def digest(self) -> str:
        """SHA-256 (hex) of the case."""
        ...

    @property
    def fingerprint(self) -> str:
        """Hash of the code that computes it."""
        ...


class Ledger:
    """The stored results below `root`, as they are at the first use of each folder, or the first after `look_again`.

    A command opens one and passes it on.
    """

    def __init__(self, root: Path, check: bool = False) -> None:
        """check: verify the checksums of all files, and not only of those that changed."""
        self.root, self.check = Path(root), check
        self.path = self.root / "cache" / "ledger.sqlite"
        self.problem = ""
        """Why lines cannot be stored; empty where they can."""
        self._folders: dict[str, dict[str, Entry]] = {}
        self._database: sqlite3.Connection | None = None

    def files(self, study: str) -> dict[str, Entry]:
        """The results files of a study (or "reference") by name, sorted; timing files too. Raises StudyError for a
        folder that may not be read."""
        if study not in self._folders:
            self._folders[study] = self._scanned(study)
        return self._folders[study]

    def look_again(self) -> None:
        """Files may have changed: the next use of each folder scans it again."""
        self._folders.clear()

    def entry(self, job: Result) -> Entry | None:
        """The file of a job, whatever is in it; None where there is none."""
        path = job.path
        return self.files(path.parent.name).get(path.name)

    def why(self, job: Result) -> str | None:
        """Why a job must run (again) (studies.store.entry); None when its result is there and current."""
        return why_entry_is_stale(self.entry(job), job.digest, job.fingerprint)

    def timing(self, job: Result, machine: str | None = None) -> Entry | None:
        """The file with the frame times of a case by a machine, this one by default."""
        path = job.path
        return self.files(path.parent.name).get(timing_name(path.name, machine or machine_id()))

    def can_be_timed(self, job: Result) -> bool:
        """Whether a case is stored that ran to its end."""
        entry = self.entry(job)
        return entry is not None and entry.status in TIMED

    def why_untimed(self, job: Result) -> str | None:
        """Why this machine must time a case (again), were it to be timed; None when it need not."""
        return why_entry_is_stale(self.timing(job), job.digest, job.fingerprint)

    def timed_somewhere(self, job: Result) -> bool:
        """Whether any machine has timed a case with this code, or none ever will, for it broke off."""
        path = job.path
        timings = [e for name, e in self.files(path.parent.name).items() if name.startswith(f"{path.stem}{TIMING}")]
        current = any(why_entry_is_stale(entry, job.digest, job.fingerprint) is None for entry in timings)
        return current or not self.can_be_timed(job)

    def measured(
        self, study: str, what: str, dependencies: Mapping[str, str], measure: Callable[[str], Any]
    ) -> dict[str, Any]:
        """What `measure` returns for the name of each file in `dependencies`, JSON-able; kept until the file changes,
        or its text there, which names all else that the value depends on. None stands for no value, and is not kept.

        what: name of the set of values.
        """
        query = "SELECT file, state, value FROM measured WHERE study = ? AND what = ?"
        kept = {(file, state): value for file, state, value in self._query(query, (study, what))}
        files, values, fresh = self.files(study), dict[str, Any](), list[tuple]()
        for file, dependency in dependencies.items():
            state = f"{files[file].state} {dependency}"
            if (file, state) in kept:
                values[file] = json.loads(kept[file, state])
            elif (value := measure(file)) is not None:
                values[file] = value
                fresh.append((study, what, file, state, json.dumps(value)))
        if fresh:
            last = "SELECT what FROM measured WHERE study = ? GROUP BY what ORDER BY max(rowid) DESC LIMIT ?"
            self._write("INSERT OR REPLACE INTO measured VALUES (?, ?, ?, ?, ?)", fresh)
            self._write(f"DELETE FROM measured WHERE study = ? AND what NOT IN ({last})", [(study, study, SETS)])
        return values

    def state(self, jobs: Iterable[Result]) -> str:
        """The files of jobs with sizes and times, as text: a copy of the folder has the same."""
        entries = ((job, self.entry(job)) for job in jobs)
        return "\n".join(entry.written if entry else f"{job.path.name} -" for job, entry in entries)

    def forget(self, study: str, names: Iterable[str]) -> None:
        """Drops these files, which are damaged: the next use of the folder reads them again."""
        self._write("DELETE FROM files WHERE study = ? AND file = ?", [(study, name) for name in names])
        self._folders.pop(study, None)

    def _scanned(self, study: str) -> dict[str, Entry]:
        folder, there = study_folder(self.root, study), dict(self._listed(study))
        query = f"SELECT {', '.join(Entry._fields)} FROM files WHERE study = ?"
        stored = {entry.file: entry for entry in map(Entry._make, self._query(query, (study,)))}
        gone = [(study, name) for name in stored if name not in there]
        for table in ("files", "measured"):
            self._write(f"DELETE FROM {table} WHERE study = ? AND file = ?", gone)
        entries = {} if self.check else {n: e for n, e in stored.items() if there.get(n) == e.state}
        changed = [name for name in there if name not in entries]
        for start in range(0, len(changed), BATCH):
            fresh = [read_entry(folder / name) for name in changed[start : start + BATCH]]
            marks = ", ".join("?" * (1 + len(Entry._fields)))
            self._write(f"INSERT OR REPLACE INTO files VALUES ({marks})", [(study, *entry) for entry in fresh])
            entries |= {entry.file: entry for entry in fresh}
        if self.problem and len(changed) > MANY:
            warnings.warn(
                f"{self.path} cannot be written ({self.problem}): every command reads all {len(changed)} files of "
                f"{folder} again",
                stacklevel=3,
            )
        return dict(sorted(entries.items()))

    def _listed(self, study: str) -> Iterator[tuple[str, tuple[int, ...]]]:
        """Names and states of the results files of a study; none where there is no folder."""
        folder, index = study_folder(self.root, study), index_path(self.root, study).name
        try:
            with os.scandir(folder) as listed:
                files = [file for file in listed if file.name.endswith(SUFFIX) and file.name != index]
            for file in files:
                if is_there(Path(file.path)):  # neither a link to itself nor replaced meanwhile
                    yield file.name, file_state(file.stat())
        except (FileNotFoundError, NotADirectoryError):
            return
        except OSError as problem:
            reason = problem.strerror or str(problem)
            raise StudyError(
                f"{folder} cannot be looked at ({reason}): change the permissions of its folder"
            ) from problem

    def _query(self, query: str, values: tuple[Any, ...]) -> list[tuple]:
        """Nothing where there is no ledger, or none that can be read."""
        if self.problem or not self.path.is_file():
            return []
        try:
            return self._opened().execute(query, values).fetchall()
        except (sqlite3.Error, OSError) as error:
            self._failed(error)
            return []

    def _write(self, statement: str, rows: Sequence[tuple]) -> None:
        """All rows or none; after a failure nothing more is tried."""
        if self.problem or not rows:
            return
        try:
            with self._opened() as database:
                database.executemany(statement, rows)
        except (sqlite3.Error, OSError) as error:
            self._failed(error)

    def _opened(self) -> sqlite3.Connection:
        """The database, emptied where it is of another layout. Raises sqlite3.Error or OSError."""
        if self._database is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            database = self._database = sqlite3.connect(self.path, timeout=PATIENCE, check_same_thread=False)
            weakref.finalize(self, database.close)
            if database.execute("PRAGMA user_version").fetchone() != (LAYOUT,):
                with database:
                    database.execute("BEGIN IMMEDIATE")
                    for table in TABLES:
                        database.execute(f"DROP TABLE IF EXISTS {table.split()[0]}")
                        database.execute(f"CREATE TABLE {table}")
                    database.execute(f"PRAGMA user_version = {LAYOUT}")
        return self._database

    def _failed(self, error: Exception) -> None:
        """Removes a damaged ledger, so that the next use makes a new one; notes any other problem."""
        if self._database is not None:
            self._database.close()
            self._database = None
        if isinstance(error, sqlite3.DatabaseError) and not isinstance(error, sqlite3.OperationalError):
            try:
                self.path.unlink(missing_ok=True)
                self.path.with_name(f"{self.path.name}-journal").unlink(missing_ok=True)
            except OSError as refused:
                error = refused
            else:
                return
        self.problem = getattr(error, "strerror", None) or str(error)
