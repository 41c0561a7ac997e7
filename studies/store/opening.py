"""The seal of a results file, and opening one: every fault is one sentence.

The seal is checked before the HDF5 library sees the file: single bits send the library into an endless loop.
"""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py

from studies.base.atomic import is_there
from studies.base.errors import DamagedFile, OpenElsewhere, OtherVersion, StudyError
from studies.base.hdf5 import reading

AGAIN = "delete it, or run its study again, which replaces it"
SUFFIX = ".h5"
SIGNATURE = b"\x89HDF\r\n\x1a\n"
FORMAT = ("v110", "v110")
"""Of HDF5: the first that can hold the views of studies.store.vtk_group."""
INDEX_KIND, VIEWS = "index", "VTKHDF"
"""Of the file that holds links to a study's records and none of their parts; the group of a record with views of its
arrays (studies.store.vtk_group)."""
SUPERBLOCK = 3
"""The byte behind the signature in files of this format."""
FLAGS_AT, END_AT = 11, 28
"""Where the superblock says that the file is open for writing, and where the file ends."""
SEAL = 160
"""Bytes behind the HDF5 file proper, whose readers ignore them."""
LABEL = b"\norganbench results; bytes and SHA-256 of what precedes these 160: "
FORMER_LABEL = b"organbench results; "
"""How files of organbench 0.2 begin, which had their checksum there."""


def sealed(image: bytes) -> bytes:
    """The HDF5 file `image` with its length and digest behind it."""
    return image + seal_of(image)


def seal_of(image: bytes | memoryview) -> bytes:
    """The SEAL bytes that belong behind an HDF5 file."""
    return (LABEL + f"{len(image)} {hashlib.sha256(image).hexdigest()}".encode()).ljust(SEAL - 1) + b"\n"


def check_seal(path: Path) -> bytes:
    """The seal of a file. Raises DamagedFile unless every byte is as it was written, OtherVersion for HDF5 without a
    seal, and OSError; about a millisecond per megabyte."""
    content = memoryview(path.read_bytes())
    head, tail, size = bytes(content[: len(FORMER_LABEL)]), bytes(content[-SEAL:]), len(content)
    if tail == seal_of(content[:-SEAL]):
        return tail
    is_hdf5 = head.startswith(SIGNATURE)
    check_not_open(path)
    other_format = is_hdf5 and head[len(SIGNATURE) :][:1] != bytes([SUPERBLOCK])
    if (other_format and not tail.startswith(LABEL)) or head == FORMER_LABEL:
        raise OtherVersion(
            f"{path} is an HDF5 file of another program, or of an earlier version of organbench, which stored no "
            "checksums or had them elsewhere: run its case again, or read it with the version that wrote it"
        )
    if is_hdf5 and content[END_AT : END_AT + 8] == size.to_bytes(8, "little"):
        raise DamagedFile(f"{path} has no checksum any more: another program has opened it for writing; {advice(path)}")
    what = "is cut off or damaged" if is_hdf5 else "is not an HDF5 file, or was cut off"
    raise DamagedFile(f"{path} {what} ({size} bytes): {advice(path)}")


def check_not_open(path: Path) -> None:
    """Raises OpenElsewhere for a results file that another program has open for writing, which it marks in the file
    (docs.hdfgroup.org, "HDF5 File Format Specification", II.A, consistency flags). A file that is whole but for the
    mark is damaged there: a program would have changed the checksum of the superblock too."""
    try:
        with path.open("rb") as file:
            head = file.read(FLAGS_AT + 1)
    except PermissionError:  # said by whoever needs the content
        return
    if head.startswith(SIGNATURE + bytes([SUPERBLOCK])) and head[FLAGS_AT:][:1] not in (b"", b"\0"):
        whole = bytearray(path.read_bytes())
        whole[FLAGS_AT] = 0
        if whole[-SEAL:] == seal_of(memoryview(whole)[:-SEAL]):
            return
        raise OpenElsewhere(
            f"{path} is open for writing in another program: close it there; if none has it open, one broke off: "
            "delete the file and run its study again"
        )


def advice(path: Path) -> str:
    """What to do about a file that cannot be read; a file by another name may be anything, such as a table."""
    return AGAIN if path.suffix == SUFFIX else f"give a results file, whose name ends in {SUFFIX}"


@contextmanager
def open_results(path: Path | str) -> Iterator[h5py.File]:
    """The HDF5 file read-only, with every byte as it was written; inside, only reading may fail.

    Raises StudyError when there is no file, it may not be read, or keeps numbers elsewhere, OpenElsewhere,
    OtherVersion for another layout, and DamagedFile for a broken seal and any error of the library.
    """
    path = Path(path)
    if path.suffix == SUFFIX and is_there(path) and not path.is_file():
        raise DamagedFile(f"{path} is not a file: delete it, and run its study again")
    if not is_there(path) or not path.is_file():
        raise StudyError(f"there is no results file {path}: `organbench run` makes those of a study or scene")
    try:
        with reading(path, INDEX_KIND, VIEWS, check_seal(path)) as file:
            yield file
    except StudyError:
        raise
    except PermissionError as problem:
        raise StudyError(f"{path} may not be read by this user: change its permissions") from problem
    except MemoryError as problem:
        raise StudyError(f"{path} does not fit into the memory of this machine: close other programs") from problem
    except Exception as problem:  # a file sealed by others brings HDF5, h5py and numpy to errors of every type
        raise DamagedFile(f"{path} is cut off or damaged: {advice(path)}") from problem
