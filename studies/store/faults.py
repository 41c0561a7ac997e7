"""Where a record differs from the table of its kind."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from studies.store.schema import INDEX, LAYOUTS, NUMBER, TEXT, WITHOUT_FIELDS, AttributeSpec, FieldSpec, Status

DTYPES = {NUMBER: "fiu", INDEX: "iu", TEXT: "U"}
TYPES = {NUMBER: (int, float), INDEX: (int,), TEXT: (str,)}
"""The numpy kinds of fields, and the Python types of attributes."""


def fault(kind: str, status: Status, attributes: Mapping[str, Any], fields: Mapping[str, Any]) -> str | None:
    """The first thing in which a record differs from its table, as the end of a sentence ("lacks 'volume'"), or None.

    fields: name -> anything with `values` and `unit`.
    """
    if kind not in LAYOUTS or status in WITHOUT_FIELDS:
        return None
    field_specs, attribute_specs = LAYOUTS[kind]
    for name, spec in attribute_specs.items():
        wrong = _attribute_fault(name, spec, attributes)
        if wrong:
            return wrong
    unknown = sorted(set(fields) - set(field_specs))
    if unknown:
        return f"holds {unknown[0]!r}, which is not a field of a {kind}"
    lengths = {spec.length: attributes[name] for name, spec in attribute_specs.items() if spec.length}
    for name, spec in field_specs.items():
        wrong = _field_fault(name, spec, fields, lengths)
        if wrong:
            return wrong
    return None


def _attribute_fault(name: str, spec: AttributeSpec, attributes: Mapping[str, Any]) -> str | None:
    value = attributes.get(name)
    if value is None:
        return None if spec.optional else f"lacks the attribute {name!r}"
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, bool) or not isinstance(value, TYPES[spec.kind]):
        return f"has {name} = {str(value)[:40]!r}, not a {spec.kind}"
    return None


def _field_fault(name: str, spec: FieldSpec, fields: Mapping[str, Any], lengths: dict[str, int]) -> str | None:
    """The first use of a letter adds its length to `lengths`."""
    if name not in fields:
        return None if spec.optional else f"lacks {name!r}"
    values = np.asarray(fields[name].values)
    if values.dtype.kind not in DTYPES[spec.kind]:
        return f"holds {name!r} as {values.dtype}, not as {spec.kind}s"
    if fields[name].unit != spec.unit:
        return f"holds {name!r} in {fields[name].unit!r}, not in {spec.unit!r}"
    letters = spec.shape.split()
    if values.ndim == len(letters):
        shape = [
            int(x) if x.isdigit() else lengths.setdefault(x, n) for x, n in zip(letters, values.shape, strict=True)
        ]
        if tuple(shape) == values.shape:
            return None
    else:
        shape = [lengths.get(x, x) for x in letters]
    return f"holds {name!r} with shape ({_row(values.shape)}), not ({_row(shape)})"


def _row(lengths: Any) -> str:
    return ", ".join(map(str, lengths))
