"""Whether a results file still says what was written: a digest of the whole file, and one of every part of it.

The first is quick, and is looked at before the HDF5 library sees the file: there are single bits that send it into an
endless loop. The second names the part that has changed, and accepts a file with added parts.
"""

import hashlib
import json
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

BLOCK = 512
"""Bytes before the HDF5 file proper, its user block: the smallest that the format allows."""
SIGNATURE = b"\x89HDF\r\n\x1a\n"
LABEL = b"organbench results; bytes and SHA-256 of what follows these 512: "
DIGITS = 16
"""Hex digits of the digest of a part."""


class Seal(Enum):
    """What the bytes of a file say."""

    WHOLE = "every byte is as it was written"
    CHANGED = "some are not"
    CUT = "some are missing"
    NONE = "it is HDF5 without such a head: of the first layout, or of another program"
    FOREIGN = "it is no HDF5 file"


def sealed(image: bytes) -> bytes:
    """The HDF5 file `image`, made with a user block of BLOCK bytes, with its length and digest in there."""
    digest = hashlib.sha256(memoryview(image)[BLOCK:]).hexdigest()
    return _head(len(image) - BLOCK, digest) + image[BLOCK:]


def seal_of(path: Path) -> Seal:
    """Whether a file is as it was sealed; about a millisecond per megabyte. Raises OSError."""
    with open(path, "rb") as file:
        head, body = file.read(BLOCK), file.read()
    if head == _head(len(body), hashlib.sha256(body).hexdigest()):
        return Seal.WHOLE
    if head.startswith(LABEL):
        declared = head[len(LABEL) :].split(b" ")[0]
        cut = len(head) < BLOCK or (declared.isdigit() and len(body) < int(declared))
        return Seal.CUT if cut else Seal.CHANGED if body.startswith(SIGNATURE) else Seal.FOREIGN
    if head.startswith(SIGNATURE):
        return Seal.NONE
    return Seal.CHANGED if body.startswith(SIGNATURE) else Seal.FOREIGN


def _head(length: int, digest: str) -> bytes:
    return (LABEL + f"{length} {digest}\n".encode()).ljust(BLOCK, b"\0")


def plain(value: Any) -> Any:
    """An attribute as it is read back: None, text, true/false, a number or a list of numbers."""
    return value if value is None else str(value) if isinstance(value, str) else np.asarray(value).tolist()


def manifest(attributes: Mapping[str, Any], fields: Mapping[str, Any]) -> str:
    """JSON text with the digest of every attribute and field (anything with values, unit, description) by name."""
    parts = {
        "attributes": {name: attribute_digest(value) for name, value in attributes.items()},
        "fields": {name: field_digest(field) for name, field in fields.items()},
    }
    return json.dumps(parts, sort_keys=True)


def attribute_digest(value: Any) -> str:
    """Of type and value."""
    return _digest(json.dumps(plain(value)).encode())


def field_digest(field: Any) -> str:
    """Of kind, shape, unit, description and values."""
    values = np.asarray(field.values)
    head = json.dumps([values.dtype.kind, values.dtype.itemsize, values.shape, field.unit, field.description])
    if values.dtype.kind == "U":  # the length of the longest is an accident of the array
        head = json.dumps(["U", values.shape, field.unit, field.description, values.tolist()])
        return _digest(head.encode())
    return _digest(head.encode(), np.ascontiguousarray(values, values.dtype.newbyteorder("<")).tobytes())


def _digest(*parts: bytes) -> str:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    return digest.hexdigest()[:DIGITS]
