"""The one way in which HDF5 files are opened for reading, whoever made them.

The library would read other files for a stranger's one (external storage, external links, virtual datasets), crash on a
virtual dataset that is its own source, and unpack a kilobyte to a terabyte.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np

from studies.base.errors import StudyError

MOST = 10_000
"""Names in a file."""
PACKED = 1100
"""Largest ratio of the bytes of a dataset to those of its file: zlib packs to 1:1032 at best."""
LONGEST = 100_000_000
"""Letters of all texts of a dataset, each as long as the longest: as NumPy stores them."""
LARGEST = 16_000_000_000
"""Bytes of a dataset, packed or not."""


@contextmanager
def reading(path: Path, index: str | None = None, views: str = "") -> Iterator[h5py.File]:
    """An HDF5 file read-only, all of whose numbers stand in the file itself.

    index: value of the attribute `kind` of a file in which links to others are expected, and not followed. views: name
    of a group in which arrays may be views of others of the same file; whoever allows it does not read there. Raises
    StudyError for a file that holds a reference to another file, or claims more than it can hold, and any error of the
    library.
    """
    path = Path(path)
    if not path.is_file():  # a pipe would wait for ever
        raise StudyError(f"{path} is no file; give one")
    with _unlocked(path) as file:
        if index is None or file.attrs.get("kind") != index:
            _check(file, path, views)
        yield file


def text_in(dataset: h5py.Dataset) -> np.ndarray:
    """Its texts, dtype kind U. Raises StudyError where they are much longer than their file."""
    texts = np.asarray(dataset.asstr()[()])
    longest = max(map(len, texts.ravel()), default=0)
    if texts.size * longest > LONGEST:
        raise StudyError(f"{dataset.file.filename}: {dataset.name} holds {texts.size} texts of up to {longest} letters")
    return texts.astype(str)


def _unlocked(path: Path) -> h5py.File:
    """Stored files never change, so no lock is needed; some network folders cannot give one. A file that this process
    already has open, as by a link of the study's index, is opened as it is open there."""
    try:
        return h5py.File(path, "r", locking=False)
    except OSError as problem:
        if "locking flag values don't match" not in str(problem):
            raise
        return h5py.File(path, "r")


def _check(file: h5py.File, path: Path, views: str) -> None:
    """Raises StudyError; follows no links, and looks into each group once."""
    size, waiting, met = path.stat().st_size, ["/"], set[object]()
    for name in waiting:
        item = file[name]
        place = h5py.h5o.get_info(item.id).addr  # pyright: ignore[reportAttributeAccessIssue]
        if isinstance(item, h5py.Dataset):  # under each of its names: under one of them it may be no view
            _check_dataset(item, path, size, bool(views) and name.startswith(f"/{views}/"))
        elif isinstance(item, h5py.Group) and place not in met:
            met.add(place)
            for key in item:
                below = f"{name.rstrip('/')}/{key}"
                if not isinstance(item.get(key, getlink=True), h5py.HardLink):
                    raise StudyError(f"{path}: {below} is a link, as to another file; put its content there")
                waiting.append(below)
            if len(waiting) > MOST:
                raise StudyError(f"{path} holds more than {MOST:,} arrays; give a file with fewer")


def _check_dataset(item: h5py.Dataset, path: Path, size: int, may_be_view: bool) -> None:
    if item.id.get_create_plist().get_external_count():
        raise StudyError(f"{path}: {item.name} keeps its numbers in another file; put them into this one")
    if item.is_virtual:
        if not may_be_view or any(source.file_name != "." for source in item.virtual_sources()):
            raise StudyError(f"{path}: {item.name} is a view of other arrays; write the numbers themselves")
    elif item.nbytes > min(size * (PACKED if item.chunks else 1), LARGEST):
        raise StudyError(f"{path}: {item.name} claims {item.nbytes:,} bytes, more than a file of {size:,} can hold")
