"""What a case produced, in one HDF5 file that explains itself: status, units, a description of every array.

A failure is a record too, with its status, its message and NaN after the moment it failed. Layout: docs/results.md.
"""

import io
import json
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.base.lookup import choose

INDEX_KIND = "index"
"""Of the file that holds links to a study's records and none of their parts."""
SCHEMA = 1
"""Version of the layout; raised when a reader of the old one would misread the new one."""


class Status(StrEnum):
    """How a case ended."""

    OK = "ok"
    DIVERGED = "diverged"
    INVERTED = "inverted"
    DRIFTED = "drifted"
    NOT_CONVERGED = "not-converged"
    BLOCKED = "blocked"
    TIMED_OUT = "timed-out"
    FAILED = "failed"
    SKIPPED = "skipped"


@dataclass(frozen=True, eq=False)
class Field:
    """An array with its unit ("1" when it has none, "" only for text) and a description of one line."""

    values: np.ndarray
    unit: str
    description: str


@dataclass(frozen=True, eq=False)
class Record:
    """One results file.

    schema: SCHEMA of the writer            kind: "run", "reference", "timing", ...
    key: the case as JSON text              name: readable, "/" makes folders in the study's index
    status, message: how it ended and why   fingerprint: of the code (studies.store.fingerprint)
    machine: id (studies.store.machine)           attributes: numbers, text, true/false, None or short lists of numbers
    fields: name -> Field; "/" in a name makes a group
    """

    schema: int
    kind: str
    key: str
    name: str
    status: Status
    message: str
    fingerprint: str
    machine: str
    attributes: dict[str, Any] = field(default_factory=dict)
    fields: dict[str, Field] = field(default_factory=dict)


HEADER = ("schema", "kind", "key", "name", "status", "message", "fingerprint", "machine")


def write_record(path: Path, record: Record) -> None:
    """Writes `record` to `path`, whole or not at all (studies.base.atomic). The folder is made when missing.

    Raises StudyError for a record that could not be read back as it is, and when the file cannot be written.
    """
    _check(record)
    # Built in memory: a full disk then fails in one plain write, never half-way inside the HDF5 library.
    image = io.BytesIO()
    with h5py.File(image, "w") as file:
        for name in HEADER:
            file.attrs[name] = _storable(getattr(record, name))
        for name, value in record.attributes.items():
            file.attrs[name] = _storable(value)
        for name, item in record.fields.items():
            data = np.asarray(item.values)
            text = h5py.string_dtype() if data.dtype.kind == "U" else None
            dataset = file.create_dataset(name, data=data.astype(object) if text else data, dtype=text)
            dataset.attrs["unit"], dataset.attrs["description"] = item.unit, item.description
    write_whole(Path(path), image.getvalue())


def read_record(path: Path, fields: Iterable[str] | None = None) -> Record:
    """The record in `path`, with all fields or only the named ones. The file is opened read-only.

    Raises StudyError when the file is missing, cut off, of another program, of another schema, or lacks a named field.
    """
    with open_results(path) as file:
        header, attributes = _attributes(path, file)
        datasets = _datasets(file)
        names = datasets if fields is None else [choose(name, list(datasets), "field") for name in fields]
        return Record(**header, attributes=attributes, fields={n: _field(datasets[n]) for n in names})


def peek(path: Path) -> Record:
    """The record in `path` without its fields: about a millisecond, whatever the size. Errors as read_record."""
    with open_results(path) as file:
        header, attributes = _attributes(path, file)
        return Record(**header, attributes=attributes)


def why_stale(path: Path, key: str, fingerprint: str) -> str | None:
    """Why the case must run (again): "missing", "unreadable: ...", "the case changed", "the code changed"; or None."""
    if not Path(path).exists():
        return "missing"
    try:
        record = peek(path)
    except StudyError as problem:
        return f"unreadable: {problem}"
    if canonical(record.key) != canonical(key):
        return "the case changed"
    return None if record.fingerprint == fingerprint else "the code changed"


def is_current(path: Path, key: str, fingerprint: str) -> bool:
    """Whether `path` holds the result of this very case by this very code (ok or failed alike)."""
    return why_stale(path, key, fingerprint) is None


def canonical(key: str) -> str:
    """The JSON text of a case with sorted names and no blanks, so that equal cases are equal text."""
    try:
        return json.dumps(json.loads(key), sort_keys=True, separators=(",", ":"))
    except ValueError as problem:
        raise StudyError(f"a case must be JSON text, not {key[:60]!r} ({problem})") from problem


@contextmanager
def open_results(path: Path) -> Iterator[h5py.File]:
    """The HDF5 file read-only, with the library's errors as one sentence (StudyError)."""
    path = Path(path)
    if not path.is_file():
        raise StudyError(f"there is no results file {path}: `organbench status` says which cases are stored")
    try:
        # Stored files never change, so no lock is needed; some network folders cannot give one.
        with h5py.File(path, "r", locking=False) as file:
            yield file
    except (OSError, RuntimeError, KeyError) as problem:
        if isinstance(problem, PermissionError):
            raise StudyError(f"{path} may not be read by this user: change its permissions") from problem
        what = "is cut off or damaged" if h5py.is_hdf5(path) else "is not an HDF5 file, or was cut off"
        raise StudyError(f"{path} {what} ({path.stat().st_size} bytes): delete it and run its case again") from problem


def _check(record: Record) -> None:
    if record.schema != SCHEMA:
        raise StudyError(f"record {record.name!r} has schema {record.schema!r}; this version writes {SCHEMA}")
    canonical(record.key)
    choose(record.status, [str(status) for status in Status], "status")
    for name, value in record.attributes.items():
        plain = value is None or isinstance(value, (str, bool, int, float, np.number, np.bool_))
        if name in HEADER or not (plain or _is_short_list(value)):
            raise StudyError(
                f"attribute {name!r} = {str(value)[:60]!r} of record {record.name!r} cannot be stored: "
                f"its name must not be one of {', '.join(HEADER)} and its value a number, text, None or a short list"
                " of numbers; an array is a field"
            )
    for name, item in record.fields.items():
        kind = np.asarray(item.values).dtype.kind
        if kind not in "biufU" or not item.description or (not item.unit and kind != "U"):
            raise StudyError(
                f"field {name!r} of record {record.name!r} needs numbers or text (not dtype kind {kind!r}), "
                f"a unit ('1' for none; it has {item.unit!r}) and a description (it has {item.description!r})"
            )


def _is_short_list(value: Any) -> bool:
    if not isinstance(value, (list, tuple, np.ndarray)):
        return False
    array = np.asarray(value)
    return array.dtype.kind in "biuf" and array.nbytes <= 4096


def _attributes(path: Path, file: h5py.File) -> tuple[dict[str, Any], dict[str, Any]]:
    values = {name: _plain(value) for name, value in file.attrs.items()}
    missing = [name for name in HEADER if name not in values]
    if "schema" in missing:
        raise StudyError(f"{path} is an HDF5 file, but not a results file of organbench: it has no schema version")
    if values["schema"] != SCHEMA:
        raise StudyError(
            f"{path} has results schema {values['schema']}, this version reads {SCHEMA}: run its case again, "
            "or read it with the version that wrote it"
        )
    if values.get("kind") == INDEX_KIND:
        raise StudyError(f"{path} is the index of a study, not a case: give one of the files beside it")
    if missing:
        raise StudyError(f"{path} lacks the attribute {missing[0]!r}: delete it and run its case again")
    header = {name: values.pop(name) for name in HEADER}
    header["status"] = Status(choose(header["status"], [str(status) for status in Status], f"status in {path}"))
    return header, values


def _storable(value: Any) -> Any:
    if value is None:
        return h5py.Empty("f8")
    return str(value) if isinstance(value, str) else value  # an Enum of text is not text to HDF5


def _plain(value: Any) -> Any:
    if isinstance(value, h5py.Empty):
        return None
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value


def _datasets(file: h5py.File) -> dict[str, h5py.Dataset]:
    found: dict[str, h5py.Dataset] = {}
    file.visititems(lambda name, item: found.update({name: item}) if isinstance(item, h5py.Dataset) else None)
    return found


def _field(dataset: h5py.Dataset) -> Field:
    text = h5py.check_string_dtype(dataset.dtype) is not None
    values = np.asarray(dataset.asstr()[()] if text else dataset[()])
    unit, description = str(dataset.attrs["unit"]), str(dataset.attrs["description"])
    return Field(values.astype(str) if text else values, unit, description)
