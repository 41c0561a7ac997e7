"""The one way in which HDF5 files are opened for reading, whoever made them.

The library would read other files for a stranger's one (external storage, external links, virtual datasets), crash on a
virtual dataset that is its own source, and unpack a kilobyte to a terabyte.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np
from h5py import h5d, h5l, h5o  # pyright: ignore[reportAttributeAccessIssue]

from studies.base.errors import StudyError

MOST = 10_000
"""Names in a file."""
PACKED = 1100
"""Largest ratio of the bytes of a dataset to those of its file: zlib packs to 1:1032 at best."""
LONGEST = 100_000_000
"""Letters of all texts of a dataset, each as long as the longest: as NumPy stores them."""
LARGEST = 16_000_000_000
"""Bytes of a dataset, packed or not."""


_checked: set[bytes] = set()
"""Digests of files whose content has been checked: a command opens each of its files several times."""


@contextmanager
def reading(path: Path, index: str | None = None, views: str = "", digest: bytes = b"") -> Iterator[h5py.File]:
    """An HDF5 file read-only, all of whose numbers stand in the file itself.

    index: value of the attribute `kind` of a file in which links to others are expected, and not followed. views: name
    of a group in which arrays may be views of others of the same file; whoever allows it does not read there. digest:
    of the content, where it is known; what was checked once is not checked again. Raises StudyError for a file that
    holds a reference to another file, or claims more than it can hold, and any error of the library.
    """
    path = Path(path)
    if not path.is_file():  # a pipe would wait for ever
        raise StudyError(f"{path} is no file; give one")
    with _unlocked(path) as file:
        if digest not in _checked and (index is None or file.attrs.get("kind") != index):
            _check(file, path, views)
            _checked.update([digest] if digest else [])
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
    """Raises StudyError; follows no links, and looks at each array once. By the calls of the library, since a record
    has a hundred names and the objects of h5py take .2 ms each."""
    names, left = dict[object, list[bytes]](), iter(range(MOST))

    def note(name: bytes, link: h5l.LinkInfo) -> str | None:
        """What is wrong, which ends the visit: h5py passes no error on."""
        if link.type != h5l.TYPE_HARD:
            return f"{path}: {_text(name)} is a link, as to another file; put its content there"
        names.setdefault(link.u, []).append(name)
        return f"{path} holds more than {MOST:,} arrays; give a file with fewer" if next(left, None) is None else None

    wrong = file.id.links.visit(note, info=True)
    if wrong is not None:
        raise StudyError(wrong)
    size, place = path.stat().st_size, f"{views}/".encode()
    for same in names.values():
        item = h5o.open(file.id, same[0])
        if isinstance(item, h5d.DatasetID):  # under each of its names: under one of them it may be no view
            _check_dataset(item, f"{path}: {_text(same[0])}", size, all(name.startswith(place) for name in same))


def _text(name: bytes) -> str:
    return "/" + name.decode(errors="replace")


def _check_dataset(item: h5d.DatasetID, what: str, size: int, may_be_view: bool) -> None:
    way = item.get_create_plist()
    if way.get_external_count():
        raise StudyError(f"{what} keeps its numbers in another file; put them into this one")
    if way.get_layout() == h5d.VIRTUAL:
        sources = {way.get_virtual_filename(k) for k in range(way.get_virtual_count())}
        if not may_be_view or sources - {"."}:
            raise StudyError(f"{what} is a view of other arrays; write the numbers themselves")
        return
    claimed = item.get_space().get_simple_extent_npoints() * item.get_type().get_size()
    if claimed > min(size * (PACKED if way.get_layout() == h5d.CHUNKED else 1), LARGEST):
        raise StudyError(f"{what} claims {claimed:,} bytes, more than a file of {size:,} can hold")
