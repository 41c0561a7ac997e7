"""Records as this version of the code, on this machine, writes them."""

from collections.abc import Mapping
from typing import Any, TypedDict, Unpack

import numpy as np

from studies.base.errors import StudyError
from studies.store.machine import machine_id
from studies.store.record import SCHEMA, Field, Record, Status
from studies.store.schema import FieldSpec


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
    """`values` as fields, with the units and descriptions of their table (studies.store.schema).

    Raises StudyError for a name that the table lacks.
    """
    unknown = sorted(set(values) - set(specs))
    if unknown:
        raise StudyError(f"no table of studies/store/schema.py lists the field {unknown[0]!r}; give it a line there")
    return {name: Field(np.asarray(v), specs[name].unit, specs[name].description) for name, v in values.items()}
