"""Texts by name, kept in SQLite between two commands: a copy of what files say, thrown away where it cannot be read.

What is on a shelf can always be made again, so nothing about it ends a command: a file that is damaged or of another
layout begins anew, and one that may not be written to, or is held by another command for too long, is done without.
"""

import sqlite3
import zlib
from collections.abc import Iterable, Mapping
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

VERSION = 1
"""Of the layout."""
PATIENCE = 20.0
"""Seconds that another command may hold the file; it writes for some hundredths."""
LAYOUT = "CREATE TABLE IF NOT EXISTS kept (room TEXT, name TEXT, state TEXT, text TEXT, sum INTEGER, \
PRIMARY KEY (room, name))"


class Kept(NamedTuple):
    """A text, and the state of what it was made from."""

    state: str
    text: str


class Shelf:
    """Texts in rooms, by name. `problem`: why what is put here is lost with this process; empty where it is kept."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.problem = ""

    def load(self, room: str) -> dict[str, Kept]:
        """All texts of a room by name. One that is not what was put there is left out."""
        found = self._query("SELECT name, state, text, sum FROM kept WHERE room = ?", (room,))
        return {name: Kept(state, text) for name, state, text, total in found if _sum(text) == total}

    def rooms(self) -> list[str]:
        """Names of the rooms, sorted."""
        return [room for (room,) in self._query("SELECT DISTINCT room FROM kept ORDER BY room")]

    def put(self, room: str, texts: Mapping[str, Kept], gone: Iterable[str] = ()) -> None:
        """Keeps texts in a room, in place of those of the same names, and forgets those of the names `gone`."""
        rows = [(room, name, state, text, _sum(text)) for name, (state, text) in texts.items()]
        self._write("DELETE FROM kept WHERE room = ? AND name = ?", [(room, name) for name in gone])
        self._write("INSERT OR REPLACE INTO kept VALUES (?, ?, ?, ?, ?)", rows)

    def drop(self, rooms: Iterable[str]) -> None:
        """Forgets all of some rooms."""
        self._write("DELETE FROM kept WHERE room = ?", [(room,) for room in rooms])

    def _query(self, query: str, values: tuple[str, ...] = ()) -> list[tuple]:
        """Nothing where there is no file, or none that can be read."""
        if not self.path.is_file():
            return []
        try:
            with closing(self._opened()) as connection:
                return connection.execute(query, values).fetchall()
        except sqlite3.Error as error:
            self._fails(error)
            return []

    def _write(self, statement: str, rows: list[tuple]) -> None:
        """All of them or none; after a failure nothing more is tried."""
        if not rows or self.problem:
            return
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with closing(self._opened()) as connection, connection:
                connection.execute("BEGIN IMMEDIATE")
                connection.executemany(statement, rows)
        except (sqlite3.Error, OSError) as error:
            self._fails(error)

    def _opened(self) -> sqlite3.Connection:
        """The file; what it holds goes where that is of another layout. Raises sqlite3.Error."""
        connection = sqlite3.connect(self.path, timeout=PATIENCE, isolation_level=None)
        try:
            if connection.execute("PRAGMA user_version").fetchone() != (VERSION,):
                connection.execute("BEGIN IMMEDIATE")
                connection.execute("DROP TABLE IF EXISTS kept")
                connection.execute(LAYOUT)
                connection.execute(f"PRAGMA user_version = {VERSION}")
                connection.execute("COMMIT")
        except sqlite3.Error:
            connection.close()
            raise
        return connection

    def _fails(self, error: Exception) -> None:
        """A damaged file goes, with what SQLite wrote beside it; any other error is told."""
        damaged = isinstance(error, sqlite3.DatabaseError) and not isinstance(error, sqlite3.OperationalError)
        if damaged or "no such table" in str(error):
            try:
                self.path.unlink(missing_ok=True)
                self.path.with_name(f"{self.path.name}-journal").unlink(missing_ok=True)
            except OSError as refused:
                error = refused
            else:
                return
        self.problem = getattr(error, "strerror", None) or str(error)


def _sum(text: str) -> int:
    """Of a text alone: one whose name or state has changed is not asked for, or is taken for an old one."""
    return zlib.crc32(text.encode())
