"""Records as this version of the code, on this machine, writes them."""

from collections.abc import Mapping
from typing import Any

from studies.store.machine import machine_id
from studies.store.record import SCHEMA, Field, Record, Status


def new_record(
    *,
    kind: str,
    key: str,
    name: str,
    status: Status,
    message: str,
    fingerprint: str,
    attributes: Mapping[str, Any],
    fields: Mapping[str, Field],
) -> Record:
    """A record with the current schema and this machine's id filled in."""
    return Record(SCHEMA, kind, key, name, status, message, fingerprint, machine_id(), dict(attributes), dict(fields))
