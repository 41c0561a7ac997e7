"""The index of a folder of results: an entry per file, of which those alone are read that have changed.

It lies in results/cache/index/FOLDER.sqlite (studies.base.shelf) and may be removed at any time.
"""

import os
import time
import warnings
from collections.abc import Iterable, Iterator
from functools import cached_property
from pathlib import Path

from studies.base.atomic import is_there
from studies.base.collection import uncollected
from studies.base.errors import StudyError
from studies.base.shelf import Kept, Shelf
from studies.store.index.entry import Entry, entry_of, read_entry, state_of, text_of
from studies.store.paths import DIGITS, SUFFIX, TIMING, index_path, study_folder
from studies.store.record import SCHEMA

ENTRIES = f"entries of schema {SCHEMA}: {' '.join(Entry._fields)}"
"""The room of a shelf that holds them: another one when they say something else."""
EACH = 5.0
"""Seconds after which what was read is kept, so that an interrupted command need not begin again."""
MANY = 1000
"""Files from which on it is told that an index cannot be kept."""


class FolderIndex:
    """The entries of all results files in the folder of a study (or of references, or entries from outside)."""

    def __init__(self, root: Path, folder: str, check: bool = False) -> None:
        """Reads what is new or has changed since; `check`: every file. Raises StudyError for a folder that may not be
        looked into."""
        self.folder, self.shelf = study_folder(root, folder), shelf_of(root, folder)
        with uncollected():
            self.states = dict(_files(self.folder, index_path(root, folder).name))
            known = self.shelf.load(ENTRIES)
            states = {} if check else {name: kept.state for name, kept in known.items()}
            self.changed = [name for name, state in self.states.items() if states.get(name) != state]
            """Names of the files that are opened."""
            self.entries = {name: entry_of(kept.text) for name, kept in known.items() if name in self.states}
        if not known:
            self.shelf.drop(room for room in self.shelf.rooms() if room.startswith("entries of schema "))
        self.shelf.put(ENTRIES, {}, [name for name in known if name not in self.states])
        self._read()

    def _read(self) -> None:
        begun, fresh = time.monotonic(), dict[str, Kept]()
        for name in self.changed:
            entry = self.entries[name] = read_entry(self.folder / name)
            fresh[name] = Kept(self.states[name], text_of(entry))
            if time.monotonic() - begun > EACH:
                self.shelf.put(ENTRIES, fresh)
                begun, fresh = time.monotonic(), {}
        self.shelf.put(ENTRIES, fresh)
        if self.shelf.problem and len(self.changed) > MANY:
            warnings.warn(
                f"{self.shelf.path} cannot be kept ({self.shelf.problem}): every command reads all {len(self.changed)} "
                f"files of {self.folder} again",
                stacklevel=3,
            )

    @cached_property
    def records(self) -> dict[str, list[Entry]]:
        """Those that are no timings, by the hash that ends their name."""
        found: dict[str, list[Entry]] = {}
        for name, entry in self.entries.items():
            if TIMING not in name:
                found.setdefault(name.removesuffix(SUFFIX)[-DIGITS:], []).append(entry)
        return found

    def timings(self) -> list[Entry]:
        """The timing files, of all machines."""
        return [entry for name, entry in self.entries.items() if TIMING in name]

    def forget(self, names: Iterable[str]) -> None:
        """The next command reads these files again."""
        self.shelf.put(ENTRIES, {}, names)


def shelf_of(root: Path, folder: str) -> Shelf:
    """Where what is known of a folder is kept."""
    return Shelf(Path(root) / "cache" / "index" / f"{folder}.sqlite")


def _files(folder: Path, links: str) -> Iterator[tuple[str, str]]:
    """Names and states of the results files in a folder; none where there is no folder."""
    try:
        with os.scandir(folder) as found:
            files = [file for file in found if file.name.endswith(SUFFIX) and file.name != links]
        for file in files:
            if is_there(Path(file.path)):  # neither a link to itself nor replaced meanwhile
                yield file.name, state_of(file.stat())
    except (FileNotFoundError, NotADirectoryError):
        return
    except OSError as problem:
        reason = problem.strerror or str(problem)
        raise StudyError(f"{folder} cannot be looked at ({reason}): change the permissions of its folder") from problem
