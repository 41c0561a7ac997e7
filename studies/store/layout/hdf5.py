"""What a new HDF5 file is made of, by the calls of the library itself: h5py's own words take twice the time.

Groups and datasets get no time stamps, so the same content is the same bytes.
"""

from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5g, h5i, h5o, h5p, h5s, h5t  # pyright: ignore[reportAttributeAccessIssue]

ID = Any
"""Of a group or dataset, in the library's words."""
TEXT = h5py.string_dtype()
LARGEST_HEAD = 60_000
"""Bytes of values; with the rest of it, a head has at most 64 kB."""
_TEXT, _SCALAR, _NOTHING = h5t.py_create(TEXT, logical=True), h5s.create(h5s.SCALAR), h5s.create(h5s.NULL)
_FOLDERS = h5p.create(h5p.LINK_CREATE)
_FOLDERS.set_create_intermediate_group(True)


def add_attribute(item: ID, name: str, value: Any) -> None:
    """Text of any length, a number, true/false, an array, or None, which is an empty one."""
    if value is None:
        h5a.create(item, name.encode(), h5t.IEEE_F64LE, _NOTHING)
        return
    text = isinstance(value, str)
    values = np.array(str(value), TEXT) if text else np.asarray(value, order="C")  # an Enum of text is not text to HDF5
    kind = _TEXT if text else h5t.py_create(values.dtype, logical=True)
    h5a.create(item, name.encode(), kind, _space(values.shape)).write(values)


def add_group(place: ID, name: str) -> ID:
    """An empty group."""
    unstamped = h5p.create(h5p.GROUP_CREATE)
    unstamped.set_obj_track_times(False)
    return h5g.create(place, name.encode(), gcpl=unstamped)


def add_dataset(place: ID, name: str | None, values: np.ndarray, deflate: bool = False) -> ID:
    """Numbers, true/false or text, the former in one chunk with a checksum; deflate: and compressed."""
    settings = _settings()
    # Checksums of values need chunks, which scalars, nothing and text of any length cannot have.
    if values.ndim and values.size and values.dtype.kind != "U":
        settings.set_chunk(values.shape)
        if deflate:
            settings.set_shuffle()
            settings.set_deflate(1)
        settings.set_fletcher32()
    return _filled(place, name, values, settings)


def add_small(place: ID, name: str | None, values: np.ndarray) -> ID:
    """Numbers in the head of a dataset, which has a checksum, as far as they fit; without a name until it is linked."""
    if values.nbytes > LARGEST_HEAD:
        return add_dataset(place, name, values)
    settings = _settings()
    settings.set_layout(h5d.COMPACT)
    return _filled(place, name, values, settings)


def add_constant(place: ID, name: str | None, shape: tuple[int, ...], value: Any) -> ID:
    """A dataset of `value`, a number of numpy, everywhere, which takes no space."""
    settings = _settings()
    settings.set_fill_value(np.asarray(value))
    return h5d.create(place, name and name.encode(), h5t.py_create(value.dtype), h5s.create_simple(shape), settings)


def add_view(place: ID, name: str, seen: ID, shape: tuple[int, ...], dtype: type | None = None) -> ID:
    """A virtual dataset of the numbers of the dataset `seen` in their order, in another shape and, if given, of another
    type."""
    settings, space = _settings(), h5s.create_simple(shape)
    settings.set_layout(h5d.VIRTUAL)
    settings.set_virtual(space, b".", h5i.get_name(seen), seen.get_space())
    return h5d.create(place, name.encode(), h5t.py_create(np.dtype(dtype or seen.dtype)), space, settings)


def link(item: ID, place: ID, name: str) -> None:
    """Gives `item` a place, or one more."""
    h5o.link(item, place, name.encode())


def _settings() -> Any:
    unstamped = h5p.create(h5p.DATASET_CREATE)
    unstamped.set_obj_track_times(False)
    return unstamped


def _filled(place: ID, name: str | None, values: np.ndarray, settings: Any) -> ID:
    text = values.dtype.kind == "U"
    kind = _TEXT if text else h5t.py_create(values.dtype, logical=True)
    item = h5d.create(place, name and name.encode(), kind, _space(values.shape), settings, _FOLDERS if name else None)
    if values.size:
        item.write(h5s.ALL, h5s.ALL, values.astype(TEXT) if text else np.asarray(values, order="C"))
    return item


def _space(shape: tuple[int, ...]) -> Any:
    return h5s.create_simple(shape) if shape else _SCALAR
