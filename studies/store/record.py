"""What a case produced, in one HDF5 file that explains itself: status, units, a description of every array.

A failure is a record too, with its status, its message and NaN after the moment it failed. Layout: schema.py.
"""

import io
import json
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypedDict, Unpack

import h5py
import numpy as np

from studies.base.atomic import write_whole
from studies.base.errors import DamagedFile, OtherVersion, StudyError
from studies.base.hdf5 import text_in
from studies.base.lookup import lookup
from studies.store.machine import machine_id
from studies.store.opening import AGAIN, FORMAT, INDEX_KIND, check_not_open, open_results, sealed
from studies.store.schema import LAYOUTS, FieldSpec, Status, fault
from studies.store.vtk_group import add_vtk_group

SCHEMA = 2
"""Version of the layout (studies.store.schema); raised when a reader of the old one would misread the new one. 1 had no
seal."""
DIMENSION = "This is a netCDF dimension but not a netCDF variable.%10d"
"""Name of a dimension scale without values (docs.unidata.ucar.edu/netcdf-c, "NetCDF-4 file format specification")."""


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
    fields: name -> Field
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


class Header(TypedDict):
    """What a record is of and how it ended, as in `Record`."""

    kind: str
    key: str
    name: str
    status: Status
    message: str
    fingerprint: str


def new_record(*, attributes: Mapping[str, Any], fields: Mapping[str, Field], **header: Unpack[Header]) -> Record:
    """A record with the current schema and this machine's id filled in."""
    return Record(schema=SCHEMA, machine=machine_id(), attributes=dict(attributes), fields=dict(fields), **header)


def new_fields(specs: Mapping[str, FieldSpec], values: Mapping[str, np.ndarray]) -> dict[str, Field]:
    """`values` as fields, with the units and descriptions of their table (schema.py).

    Raises StudyError for a name that the table lacks.
    """
    unknown = sorted(set(values) - set(specs))
    if unknown:
        raise StudyError(f"no table of studies/store/schema.py lists the field {unknown[0]!r}; give it a line there")
    return {name: Field(np.asarray(v), specs[name].unit, specs[name].description) for name, v in values.items()}


TEXT = h5py.string_dtype()
HEADER = ("schema", "kind", "key", "name", "status", "message", "fingerprint", "machine")


def write_record(path: Path | str, record: Record) -> None:
    """Writes `record` to `path`, whole or not at all (studies.base.atomic). The folder is made when missing.

    Raises StudyError for a record that could not be read back as it is, when the file cannot be written, and when
    another program has it open for writing.
    """
    _check(record)
    path = Path(path)
    if path.is_file():
        check_not_open(path)
    # Built in memory: a full disk then fails in one plain write, never half-way inside the HDF5 library.
    image = io.BytesIO()
    with h5py.File(image, "w", libver=FORMAT) as file:
        attributes = {name: getattr(record, name) for name in HEADER} | record.attributes
        for name, value in attributes.items():
            plain = str(value) if isinstance(value, str) else value  # an Enum of text is not text to HDF5
            file.attrs[name] = h5py.Empty("f8") if value is None else plain
        datasets = {name: _add_field(file, name, item) for name, item in record.fields.items()}
        _name_dimensions(file, record.kind, datasets)
        add_vtk_group(file, record.kind, datasets)
    write_whole(path, sealed(image.getvalue()))


def _add_field(file: h5py.File, name: str, item: Field) -> h5py.Dataset:
    values = np.asarray(item.values)
    dataset = file.create_dataset(name, data=values.astype(TEXT) if values.dtype.kind == "U" else values)
    dataset.attrs.update({"unit": item.unit, "description": item.description})
    return dataset


def _name_dimensions(file: h5py.File, kind: str, datasets: Mapping[str, h5py.Dataset]) -> None:
    """Dimension scales called as the letters of studies.store.schema, as netCDF-4 has them: xarray names dims so."""
    scales: dict[str, h5py.Dataset] = {}
    for name, dataset in datasets.items() if kind in LAYOUTS else ():
        for axis, letter in enumerate(LAYOUTS[kind][0][name].shape.split()):
            if letter not in scales:
                length = dataset.shape[axis]
                scales[letter] = file.create_dataset(letter, (length,), "f4")
                scales[letter].make_scale(DIMENSION % length)
            dataset.dims[axis].attach_scale(scales[letter])


def read_record(path: Path | str, fields: Iterable[str] | None = None) -> Record:
    """The record in `path`, with all fields or only the named ones; with all of them, checked against its
    table (studies.store.schema). The file is opened read-only.

    Raises StudyError when the file is missing, of another program, open for writing in one, or lacks a named field,
    DamagedFile when its content is not what was written, OtherVersion for another schema.
    """
    path = Path(path)
    with open_results(path) as file:
        record = _header(path, file)
        stored = {name: item for name, item in file.items() if isinstance(item, h5py.Dataset) and not item.is_scale}
        names = stored if fields is None else [lookup(name, list(stored), "field") for name in fields]
        record = replace(record, fields={name: _field(path, stored[name]) for name in names})
    wrong = None if fields is not None else fault(record.kind, record.status, record.attributes, record.fields)
    if wrong:
        raise DamagedFile(f"{path} {wrong}: {AGAIN}")
    return record


def peek(path: Path | str, attributes: Collection[str] | None = None) -> Record:
    """The record in `path` without its fields: 5 ms, and 1 ms for every megabyte. Errors as read_record.

    attributes: only these, where they exist, which takes a third of the time for a small file."""
    with open_results(path) as file:
        return _header(Path(path), file, None if attributes is None else (*HEADER, *attributes))


def canonical(key: str) -> str:
    """The JSON text of a case with sorted names and no blanks, so that equal cases are equal text: also where a file
    of the same "sha256" has another "path"."""
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
        if name in HEADER or not (simple or _is_short_list(value)):
            raise StudyError(
                f"attribute {name!r} = {str(value)[:60]!r} of record {record.name!r} cannot be stored: "
                f"its name must not be one of {', '.join(HEADER)} and its value a number, text, None or a short list"
                " of numbers; an array is a field"
            )
    for name in (name for name in HEADER if "\0" in str(getattr(record, name))):
        raise StudyError(
            f"{name} {getattr(record, name)[:60]!r} of a record contains a null byte, which cannot be stored"
        )
    for name, item in record.fields.items():
        kind = np.asarray(item.values).dtype.kind
        if "/" in name or kind not in "biufU" or not item.description or (not item.unit and kind != "U"):
            raise StudyError(
                f"field {name!r} of record {record.name!r} needs a name without '/', numbers or text (not dtype kind "
                f"{kind!r}), a unit ('1' for none; it has {item.unit!r}) and a description ({item.description!r})"
            )
    wrong = fault(record.kind, record.status, record.attributes, record.fields)
    if wrong:
        raise StudyError(f"record {record.name!r} {wrong}; studies/store/schema.py lists what a {record.kind} holds")


def _is_short_list(value: Any) -> bool:
    if not isinstance(value, (list, tuple, np.ndarray)):
        return False
    array = np.asarray(value)
    return array.dtype.kind in "biuf" and array.nbytes <= 4096


def _header(path: Path, file: h5py.File, selection: Collection[str] | None = None) -> Record:
    """The record without fields. selection: names of the attributes to read; None: all."""
    attributes = file.attrs  # every access makes a new object, which opens the file's root
    if "schema" not in attributes:
        raise StudyError(f"{path} is an HDF5 file, but not a results file of organbench: it has no schema version")
    schema = _plain(attributes["schema"])
    if schema != SCHEMA:
        raise OtherVersion(
            f"{path} has results schema {schema}, this version reads {SCHEMA}: run its case again, "
            "or read it with the version that wrote it"
        )
    if _plain(attributes.get("kind")) == INDEX_KIND:
        raise StudyError(f"{path} is the index of a study, not a case: give one of the files next to it")
    names = [name for name in selection or attributes if name in attributes]
    values = {name: _plain(attributes[name]) for name in names}
    header = {name: values.pop(name) for name in HEADER}
    header["status"] = Status(lookup(header["status"], [str(status) for status in Status], f"status in {path}"))
    json_in(header["key"], f"the case in {path}")
    return Record(**header, attributes=values)


def json_in(text: Any, what: str) -> dict[str, Any]:
    """The object that stands in a record as JSON. Raises DamagedFile for any other text."""
    try:
        data = json.loads(text)
        if isinstance(data, dict):
            return data
    except (TypeError, ValueError, RecursionError) as problem:
        raise DamagedFile(f"{what} is no JSON text ({problem}): {AGAIN}") from problem
    raise DamagedFile(f"{what} is no JSON object: {AGAIN}")


def _plain(value: Any) -> Any:
    """An attribute as it is read: None, text, true/false, a number or a list of numbers."""
    return None if isinstance(value, h5py.Empty) else value if isinstance(value, str) else np.asarray(value).tolist()


def _field(path: Path, dataset: h5py.Dataset) -> Field:
    values = np.asarray(dataset[()]) if h5py.check_string_dtype(dataset.dtype) is None else text_in(dataset)
    return Field(values, str(dataset.attrs["unit"]), str(dataset.attrs["description"]))
