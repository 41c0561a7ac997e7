"""What a case produced, in one HDF5 file that explains itself: status, units, a description of every array.

A failure is a record too, with its status, its message and NaN after the moment it failed. Layout: schema.py.
"""

import io
import json
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from studies.base.atomic import write_whole
from studies.base.errors import DamagedFile, OtherVersion, StudyError
from studies.base.lookup import lookup
from studies.store.checksums import BLOCK, attribute_digest, field_digest, manifest, plain, sealed
from studies.store.faults import fault
from studies.store.layout.hdf5 import add_attribute, add_dataset
from studies.store.layout.vtk_group import GROUP, add_vtk_group
from studies.store.opening import AGAIN, open_results
from studies.store.schema import Status
from studies.store.trial_read import read_all

INDEX_KIND = "index"
"""Of the file that holds links to a study's records and none of their parts."""
SCHEMA = 2
"""Version of the layout (studies.store.schema); raised when a reader of the old one would misread the new one. 1 had no
checksums."""
FORMAT = ("v110", "v110")
"""Of HDF5: the first that can hold the views of studies.store.layout.vtk_group, has checksums of its own for all but
values, and needs no tree for a dataset of one chunk."""
CHECKSUMS = "checksums"
"""Attribute with the digests of all others and of all fields (studies.store.checksums)."""


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
    status, message: how it ended and why   fingerprint: of the code (massspring.sources)
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
    with h5py.File(image, "w", libver=FORMAT, userblock_size=BLOCK) as file:
        attributes = {name: getattr(record, name) for name in HEADER} | record.attributes
        for name, value in attributes.items():
            add_attribute(file.id, name, value)
        add_attribute(file.id, CHECKSUMS, manifest(attributes, record.fields))
        items = {name: add_dataset(file.id, name, np.asarray(field.values)) for name, field in record.fields.items()}
        for name, item in record.fields.items():
            add_attribute(items[name], "unit", item.unit)
            add_attribute(items[name], "description", item.description)
        add_vtk_group(file.id, record.kind, record.fields, items)
    write_whole(Path(path), sealed(image.getvalue()))


def read_record(path: Path, fields: Iterable[str] | None = None) -> Record:
    """The record in `path`, with all fields or only the named ones, each held to its checksum; with all of them, the
    record also to its table (studies.store.schema). The file is opened read-only. Parts that others added are left out.

    Raises StudyError when the file is missing, of another program or lacks a named field, DamagedFile when its content
    is not what was written, OtherVersion for another schema.
    """
    with open_results(path) as (file, untouched):
        record, digests = _header(path, file)
        names = digests if fields is None else [lookup(name, list(digests), "field") for name in fields]
        record = replace(record, fields={name: _field(path, file, name, digests[name]) for name in names})
        if fields is None and not untouched and GROUP in file:
            read_all(file[GROUP], path.stat().st_size)  # held to the checksums of the format
    wrong = None if fields is not None else fault(record.kind, record.status, record.attributes, record.fields)
    if wrong:
        raise DamagedFile(f"{path} {wrong}: {AGAIN}")
    return record


def peek(path: Path) -> Record:
    """The record in `path` without its fields, but held to all checksums: some milliseconds, and one for every
    megabyte. Errors as read_record."""
    with open_results(path) as (file, untouched):
        record = _header(path, file)[0]
    return record if untouched else replace(read_record(path), fields={})


def glance(path: Path, attributes: Collection[str]) -> Record:
    """As `peek`, with those of the named attributes that are there alone: a third of the time for a small file."""
    with open_results(path) as (file, untouched):
        if untouched:
            return _header(path, file, (*HEADER, *attributes))[0]
    return peek(path)


def canonical(key: str) -> str:
    """The JSON text of a case with sorted names and no blanks, so that equal cases are equal text: also where a file
    that is known by its "sha256" has another "path"."""
    try:
        hook = _without_path if '"sha256"' in key else None
        return json.dumps(json.loads(key, object_hook=hook), sort_keys=True, separators=(",", ":"))
    except (TypeError, ValueError, RecursionError) as problem:
        raise StudyError(f"a case must be JSON text, not {str(key)[:60]!r} ({problem})") from problem


def _without_path(entry: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in entry.items() if name != "path" or "sha256" not in entry}


def _check(record: Record) -> None:
    if record.schema != SCHEMA:
        raise StudyError(f"record {record.name!r} has schema {record.schema!r}; this version writes {SCHEMA}")
    canonical(record.key)
    lookup(record.status, [str(status) for status in Status], "status")
    for name, value in record.attributes.items():
        simple = value is None or isinstance(value, (str, bool, int, float, np.number, np.bool_))
        if name in (*HEADER, CHECKSUMS) or not (simple or _is_short_list(value)):
            raise StudyError(
                f"attribute {name!r} = {str(value)[:60]!r} of record {record.name!r} cannot be stored: "
                f"its name must not be one of {', '.join(HEADER)} and its value a number, text, None or a short list"
                " of numbers; an array is a field"
            )
    for name in (name for name in HEADER if "\0" in str(getattr(record, name))):
        raise StudyError(f"{name} {getattr(record, name)[:60]!r} of a record holds a zero byte, which no file can keep")
    for name, item in record.fields.items():
        kind = np.asarray(item.values).dtype.kind
        if kind not in "biufU" or not item.description or (not item.unit and kind != "U"):
            raise StudyError(
                f"field {name!r} of record {record.name!r} needs numbers or text (not dtype kind {kind!r}), "
                f"a unit ('1' for none; it has {item.unit!r}) and a description (it has {item.description!r})"
            )
    wrong = fault(record.kind, record.status, record.attributes, record.fields)
    if wrong:
        raise StudyError(f"record {record.name!r} {wrong}; studies/store/schema.py lists what a {record.kind} holds")


def _is_short_list(value: Any) -> bool:
    if not isinstance(value, (list, tuple, np.ndarray)):
        return False
    array = np.asarray(value)
    return array.dtype.kind in "biuf" and array.nbytes <= 4096


def _header(path: Path, file: h5py.File, wanted: Collection[str] | None = None) -> tuple[Record, dict[str, str]]:
    """The record without fields, and the digest of each field by name. `wanted`: of its attributes these alone, of a
    file of which every byte is known to be as it was written."""
    attributes = file.attrs  # a new one each time it is asked for, and each opens the file's root
    if "schema" not in attributes:
        raise StudyError(f"{path} is an HDF5 file, but not a results file of organbench: it has no schema version")
    schema = _plain(attributes["schema"])
    if schema != SCHEMA:
        raise OtherVersion(
            f"{path} has results schema {schema}, this version reads {SCHEMA}: run its case again, "
            "or read it with the version that wrote it"
        )
    if _plain(attributes.get("kind")) == INDEX_KIND:
        raise StudyError(f"{path} is the index of a study, not a case: give one of the files beside it")
    if CHECKSUMS not in attributes:
        raise DamagedFile(f"{path} lacks the attribute {CHECKSUMS!r}: {AGAIN}")
    digests = json.loads(str(attributes[CHECKSUMS]))
    if wanted is None:
        values = {name: _checked(path, attributes, name, digest) for name, digest in digests["attributes"].items()}
    else:
        values = {name: _plain(attributes[name]) for name in wanted if name in digests["attributes"]}
    header = {name: values.pop(name) for name in HEADER}
    header["status"] = Status(lookup(header["status"], [str(status) for status in Status], f"status in {path}"))
    return Record(**header, attributes=values), digests["fields"]


def _checked(path: Path, attributes: h5py.AttributeManager, name: str, digest: str) -> Any:
    if name not in attributes:
        raise DamagedFile(f"{path} lacks the attribute {name!r}: {AGAIN}")
    value = _plain(attributes[name])
    if attribute_digest(value) != digest:
        raise DamagedFile(f"{path}: the attribute {name!r} has changed since it was written: {AGAIN}")
    return value


def _plain(value: Any) -> Any:
    return None if isinstance(value, h5py.Empty) else plain(value)


def _field(path: Path, file: h5py.File, name: str, digest: str) -> Field:
    dataset = file.get(name)
    if not isinstance(dataset, h5py.Dataset):
        raise DamagedFile(f"{path} lacks {name!r}: {AGAIN}")
    for part in ("unit", "description"):
        if part not in dataset.attrs:
            raise DamagedFile(f"{path}: {name!r} has lost its {part}: {AGAIN}")
    text = h5py.check_string_dtype(dataset.dtype) is not None
    if not text and dataset.nbytes > path.stat().st_size:  # nothing is compressed
        raise DamagedFile(f"{path}: {name!r} claims {dataset.nbytes} bytes, more than the file has: {AGAIN}")
    values = np.asarray(dataset.asstr()[()] if text else dataset[()])
    found = Field(values.astype(str) if text else values, str(dataset.attrs["unit"]), str(dataset.attrs["description"]))
    if field_digest(found) != digest:
        raise DamagedFile(f"{path}: {name!r} has changed since it was written: {AGAIN}")
    return found
